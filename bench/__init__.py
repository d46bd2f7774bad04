"""Measurements that take too long for a test. `python -m bench` runs them and writes docs/benchmarks.md."""
