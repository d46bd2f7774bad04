"""The seeds of drawn forces: fixed after the code, so that nothing was tuned on the draws."""

DRAWN, KNOWN, COUNT = 550_000, 551_000, 300
SHORT_DRAWN, SHORT_KNOWN, SHORT_COUNT = 391_500, 392_000, 24
"""First seeds of drawn forces and of known effects, and the number of each; the short form, which anyone may look at,
uses seeds of development."""
