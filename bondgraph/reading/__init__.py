"""From files and tables to checked, even, SI columns; `bondgraph.signals` makes recordings."""
