"""The plain functions behind the verbs, with typed steps and results: `identify`, `diagnose`, `validate`, `plan`."""
