"""Widgets: each turns a `View` into lines of text, and redraws only the lines that changed."""
