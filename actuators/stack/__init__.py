"""The piezo stack: graphs, operators, sizing, excitation, loading curve."""
