"""The next experiment: designed signals, frequency responses."""
