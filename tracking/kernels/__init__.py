"""How numba kernels are compiled, cached and called."""
