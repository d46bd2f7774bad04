"""Recordings to dives: `open.read_dive` looks at a file or folder and hands it to the reader of its format."""
