"""Frozen ranges: a radio that repeats one number while its nodes move.

Radios round to a millimetre or a centimetre, and some report every range twice, so a few equal
ranges are no fault; recordings that are rounded to a centimetre have runs of up to 11. Nodes at
rest may repeat one indefinitely. But noise of several centimetres does not repeat while they move.
"""

from __future__ import annotations

import math

from tracking.filters.joint.hypotheses.static_initialisation import is_at_rest
from tracking.kernels.jit import small_kernel


@small_kernel
def is_frozen(c, s, p, t, distance):
    """True if a range repeats the earlier ranges of pair p too often; counts it in any case.

    Such ranges are ignored until the number changes, also if the nodes have left by then.
    """
    pair = s.pairs[p]
    if distance != pair.last_range:
        pair.last_range, pair.t_last = distance, t
        pair.n_equal, pair.distance_travelled = 0, 0.0
        return False
    pair.n_equal += 1
    pair.distance_travelled += (t - pair.t_last) * (
        certain_speed(c, s, s.nodes[pair.i], t) + certain_speed(c, s, s.nodes[pair.j], t)
    )
    pair.t_last = t
    return pair.n_equal > c.frozen_ranges and pair.distance_travelled > c.frozen_distance


@small_kernel
def certain_speed(c, s, node, t):
    """Return the speed of a node in the best hypothesis [m/s]; 0 if it may be at rest."""
    if node.static or not node.present:
        return 0.0
    if is_at_rest(c, node, t):
        return 0.0
    h, squared = s.group[0].best, 0.0
    for k in range(c.d):
        squared += s.x[h, node.i_vel + k] ** 2
    speed = math.sqrt(squared)
    return speed if speed > c.frozen_speed else 0.0
