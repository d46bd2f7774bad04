"""Checks of a recording against itself and its fit: a module for each contradiction, `contradictions` lists them."""
