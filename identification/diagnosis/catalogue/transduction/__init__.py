"""Effects in what carries power from one side to another."""
