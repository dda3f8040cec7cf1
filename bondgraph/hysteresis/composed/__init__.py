"""Operators made of other operators: in series and in parallel."""
