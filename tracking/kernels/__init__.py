"""Compilation, caching and calls of numba kernels."""
