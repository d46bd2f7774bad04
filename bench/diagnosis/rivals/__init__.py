"""Other methods to name an effect that a model lacks, as simple as their authors have them, on the same dives."""
