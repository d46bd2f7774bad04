"""The identified model in the files of other simulators."""
