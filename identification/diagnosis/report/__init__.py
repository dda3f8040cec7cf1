"""Sections, words and figures of the page of a diagnosis; the page itself is the studio."""
