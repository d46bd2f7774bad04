"""Identification from dives: dive (the dataset), ingest (.tlog, .BIN, CSV to dive), estimators, validate, report."""
