"""The verdict as a document, read and written, and in words."""
