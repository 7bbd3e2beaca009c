"""Counter-based random numbers: a draw depends on its key and counter, not on other draws.

SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) hashes a key and a counter. Environments, messages
and sensors can therefore be computed in any order and get the same numbers.
"""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import small_kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_A = np.uint64(0xBF58476D1CE4E5B9)
_B = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@small_kernel
def draw_key(seed, counter):
    """Return the key of a counter under a seed, both uint64; every counter has its own key."""
    x = seed + _GOLDEN * (counter + np.uint64(1))
    x = (x ^ (x >> _S30)) * _A
    x = (x ^ (x >> _S27)) * _B
    return x ^ (x >> _S31)


@small_kernel
def uniform(key, k):
    """Return the k-th number of a key, uniform in (0, 1)."""
    return (float(draw_key(key, np.uint64(k)) >> _S11) + 0.5) * (1.0 / 9007199254740992.0)
