"""One estimator a file; `table.METHODS` names them. Each turns a Dive into an Identification."""
