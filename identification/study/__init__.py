"""What is fitted to what: the study, and the problems it makes."""
