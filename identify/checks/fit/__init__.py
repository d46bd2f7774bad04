"""Doubts about a fit: `doubts`, and `unmodelled` of a model that lacks a force."""
