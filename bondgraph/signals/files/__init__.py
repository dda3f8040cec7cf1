"""From files to checked, even columns in SI, one file format a module."""
