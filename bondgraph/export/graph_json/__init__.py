"""Graphs as JSON: written, and read from strangers without executing anything."""
