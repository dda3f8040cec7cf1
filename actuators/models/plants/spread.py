"""How well the values of a plant are known to the one who draws its model."""

SPREAD = 3.0
"""A drawing or a data sheet knows a value within this factor."""
