"""Generator of the sealed trial; it imports nothing of the rest of the project."""
