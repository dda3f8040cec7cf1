"""Export of equations to other notations and tools, a file each, and `formats` for all of them."""
