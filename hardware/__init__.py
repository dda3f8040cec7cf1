"""Hardware and virtual hardware of the Bondsight benches."""
