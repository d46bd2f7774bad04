"""What a plain diagonal model leaves out: the effects that a diagnosis tries, and that a simulator can plant."""
