"""Effects that take energy from a mechanical motion."""
