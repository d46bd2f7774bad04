"""Forces that a grammar draws, so that nobody chose them: whether the diagnosis says that it knows no cause."""
