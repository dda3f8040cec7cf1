"""Evidence: the sealed trial, real and published recordings, conformance."""
