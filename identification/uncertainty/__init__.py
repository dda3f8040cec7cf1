"""What data determine and what they do not, in numbers and in words."""
