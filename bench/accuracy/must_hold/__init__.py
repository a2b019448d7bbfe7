"""Required results, one module for each theme; `python -m bench.accuracy.error_vs_time` prints them."""
