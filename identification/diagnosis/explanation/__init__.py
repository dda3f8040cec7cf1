"""What a latent signal looks like, and which experiment comes next."""
