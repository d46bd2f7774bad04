"""Screens: `frame` is their common base, `table` lists them."""
