"""Data meets physics: problems, fits and diagnosis."""
