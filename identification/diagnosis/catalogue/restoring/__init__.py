"""Effects in what gives a displacement back: springs, contacts, gaps."""
