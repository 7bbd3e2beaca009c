"""Random numbers by counting: a draw depends on what it is for, never on the draws before it.

SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) as a hash of a key and a counter; so environments,
messages and sensors can be computed in any order and still get the same numbers.
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
    """A key of its own for every count under a seed, both uint64."""
    x = seed + _GOLDEN * (counter + np.uint64(1))
    x = (x ^ (x >> _S30)) * _A
    x = (x ^ (x >> _S27)) * _B
    return x ^ (x >> _S31)


@small_kernel
def uniform(key, k):
    """The k-th number of a key, uniform in (0, 1)."""
    return (float(draw_key(key, np.uint64(k)) >> _S11) + 0.5) * (1.0 / 9007199254740992.0)
