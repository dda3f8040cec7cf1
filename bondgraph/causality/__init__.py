"""Causality: strokes with reasons, alternatives, conflicts."""
