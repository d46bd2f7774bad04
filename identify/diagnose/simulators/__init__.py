"""A dive against a simulator's: `thrust_ratio` of the two, the `simulator` held as the model, their `comparison`."""
