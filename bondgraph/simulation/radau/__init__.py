"""Radau IIA over whole records of any program, with exact sensitivities."""
