"""The gap between model and sea: where it lies, which effect causes it, how far it shrinks."""
