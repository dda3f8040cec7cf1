"""The language: elements, bonds, the ``with`` block, sub-models, checks, domains."""
