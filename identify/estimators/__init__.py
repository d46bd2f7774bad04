"""One estimator per file; `table.METHODS` lists them. Each turns a Dive into an Identification."""
