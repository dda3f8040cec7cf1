"""Sealed trial of the diagnosis: generator, run and score; see the modules' own docstrings."""
