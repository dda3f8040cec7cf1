"""Bondsight: the front door and the command line."""
