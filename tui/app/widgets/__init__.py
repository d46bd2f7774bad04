"""Widgets: each works out lines of text from a `View`, and draws again only those that changed."""
