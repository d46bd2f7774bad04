"""The parts of docs/ made from the code: the reference by `python -m docs.make`, pictures by `docs.make.pictures`."""
