"""Effects between a command and the source that should follow it."""
