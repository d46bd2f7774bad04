"""What is learnt from a dive: dive (the dataset), ingest (.tlog, .BIN, CSV to dive), estimators, validate, report."""
