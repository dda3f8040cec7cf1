"""What is timed, beside peers."""
