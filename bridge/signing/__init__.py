"""Signed links: `key` the file of the key and the signatures of frames, `link` who is let in, and who is told of."""
