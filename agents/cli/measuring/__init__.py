"""Commands for benchmarks and compilation."""
