"""Forces drawn by a grammar, so that nobody chose them: whether the diagnosis says that it knows no cause."""
