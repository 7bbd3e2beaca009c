"""Ranges that stick: a radio that reports one number again and again while its nodes move.

Radios round to a millimetre or a centimetre, and some report every range twice, so that a few
equal ranges mean nothing: of the recordings that the filter was tried on, those rounded to a
centimetre have runs of up to 11. Nodes at rest may repeat one for ever. But noise of several
centimetres does not repeat while the ends travel.
"""

from __future__ import annotations

import math

from tracking.jit import small_kernel
from tracking.filters.joint._sleep_kernels import rests


@small_kernel
def is_stuck(c, s, p, t, distance):
    """True if a range repeats what pair p has reported all along; notes it in any case.

    It is taken as not heard until another number comes, also when its nodes have left by then.
    """
    pair = s.pairs[p]
    if distance != pair.last:
        pair.last, pair.t_last = distance, t
        pair.n_same, pair.way = 0, 0.0
        return False
    pair.n_same += 1
    pair.way += (t - pair.t_last) * (
        sure_speed(c, s, s.nodes[pair.i], t) + sure_speed(c, s, s.nodes[pair.j], t)
    )
    pair.t_last = t
    return pair.n_same > c.frozen_ranges and pair.way > c.frozen_distance


@small_kernel
def sure_speed(c, s, node, t):
    """Speed of a node in the best hypothesis [m/s]; 0 where it may stand."""
    if node.static or not node.present:
        return 0.0
    if rests(c, node, t):
        return 0.0
    h, squared = s.group[0].best, 0.0
    for k in range(c.d):
        squared += s.x[h, node.at_v + k] ** 2
    speed = math.sqrt(squared)
    return speed if speed > c.frozen_speed else 0.0
