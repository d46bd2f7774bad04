"""Screens: `frame` is what all have in common, `table` lists them."""
