"""Other ways to name what a model lacks, as simple as their authors have them, on the same dives."""
