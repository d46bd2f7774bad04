"""Screens, each with its lines beside it (`NAME_lines`); `frame` is their common base, `table` lists them."""
