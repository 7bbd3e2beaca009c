"""Counter-based normal random numbers: the ziggurat of Marsaglia and Tsang [1].

The area under half of exp(-x^2 / 2) is cut into 256 layers of equal area, the lowest of which
contains the tail. A number is drawn uniformly within a uniformly drawn layer; for all but one in
a hundred, no density needs to be evaluated. Layer and number use different bits of a draw, since
they would depend on each other otherwise [2].

References:
    [1] Marsaglia, Tsang, The Ziggurat Method for Generating Random Variables, Journal of
        Statistical Software 5(8), 2000.
    [2] Doornik, An Improved Ziggurat Method to Generate Normal Random Samples, University of
        Oxford, 2005.
"""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.arrays import F64
from tracking.kernels.jit import kernel, small_kernel

N_LAYERS = 256
TAIL = 3.6541528853610088
"""Start of the tail for which `N_LAYERS` layers end at 0 [1]."""


def layer_edges() -> F64:
    """Return the widths of the layers from the lowest on, (layer + 1), with a final 0.

    The width of the lowest layer is that of a rectangle of its area.
    """
    density = math.exp(-0.5 * TAIL**2)
    area = TAIL * density + math.sqrt(0.5 * math.pi) * math.erfc(TAIL / math.sqrt(2.0))
    edges = np.zeros(N_LAYERS + 1)
    edges[0], edges[1] = area / density, TAIL
    for k in range(2, N_LAYERS):
        density += area / edges[k - 1]
        edges[k] = math.sqrt(-2.0 * math.log(density))
    return edges


EDGES = layer_edges()
DENSITIES = np.exp(-0.5 * EDGES**2)
STEPS = EDGES * 2.0**-52
"""Spacing of the numbers in each layer: 2^52 to either side."""
_LAYER, _REST = np.uint64(N_LAYERS - 1), np.int64(11)
APART = 64
"""Counter distance between the numbers of one key; no number needs as many draws."""


@small_kernel
def normal(key, k):
    """Return the k-th standard normal number of a key."""
    at = APART * (k + 1)
    bits = draw_key(key, np.uint64(at))
    layer = np.int64(bits & _LAYER)
    x = float(np.int64(bits) >> _REST) * STEPS[layer]
    return x if abs(x) < EDGES[layer + 1] else _rare_normal(key, at, layer, x)


@kernel
def _rare_normal(key, at, layer, x):
    """Accept a number at the edge of its layer, or draw again if it is above the density."""
    while abs(x) >= EDGES[layer + 1]:
        if layer == 0:
            return math.copysign(_tail(key, at), x)
        low, high = DENSITIES[layer], DENSITIES[layer + 1]
        if low + uniform(key, at + 1) * (high - low) < math.exp(-0.5 * x * x):
            return x
        at += 2
        bits = draw_key(key, np.uint64(at))
        layer = np.int64(bits & _LAYER)
        x = float(np.int64(bits) >> _REST) * STEPS[layer]
    return x


@small_kernel
def _tail(key, at):
    """Return a number in the tail (Marsaglia, Technometrics 6(1), 1964)."""
    while True:
        at += 2
        beyond = -math.log(uniform(key, at - 1)) / TAIL
        if -2.0 * math.log(uniform(key, at)) > beyond * beyond:
            return TAIL + beyond
