"""Where the mismatch sits: in the model and in the recording."""
