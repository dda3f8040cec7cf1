"""The command ``bondsight``: joins models, recordings, diagnosis and the virtual bench."""
