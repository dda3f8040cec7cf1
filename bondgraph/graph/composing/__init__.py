"""Graphs made of graphs: sub-models, libraries, rewriting."""
