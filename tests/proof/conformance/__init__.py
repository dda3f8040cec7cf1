"""Published bond graphs with their results, and the judge of any tool's answers to them."""
