"""Effects that a plain diagonal model leaves out: a diagnosis tests for them, and a simulator can plant them."""
