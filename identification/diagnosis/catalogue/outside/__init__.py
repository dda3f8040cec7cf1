"""Effects from outside of the model: disturbances, drifting parameters, curves without name."""
