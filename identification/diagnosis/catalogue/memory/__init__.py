"""Effects with memory: what a port does depends on its past."""
