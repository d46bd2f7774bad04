"""Forces drawn by a grammar, so that nobody chose them: whether the diagnosis says that it knows no cause.

`grammar` of the forces · `planted` a force put into a dive · `trials` their diagnosis · `section` the page.
"""
