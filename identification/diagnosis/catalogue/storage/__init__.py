"""Effects in what a storage keeps, and in what hangs on it."""
