"""Models by name, and textbook models where a diagnosis starts."""
