"""The decision: what held-out data say of the candidates."""
