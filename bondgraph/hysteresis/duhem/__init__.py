"""Operators given by a slope that depends on direction and state: Bouc-Wen, Dahl."""
