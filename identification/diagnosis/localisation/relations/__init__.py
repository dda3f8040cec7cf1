"""Relations of the residual that a latent signal at a port cannot touch."""
