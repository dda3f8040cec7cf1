"""Start values from the data: measured responses, and many models tried on them at once."""
