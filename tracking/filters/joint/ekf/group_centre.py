"""The centre of a group and how it moves, as a hypothesis estimates it."""

from __future__ import annotations

import numpy as np

from tracking.kernels.jit import allocating_kernel


@allocating_kernel
def group_centre(c, s, h):
    """Mean position [m] and velocity [m/s] of the present nodes in hypothesis h, (d) each.

    With static nodes, velocities have no common part that is free: 0.
    """
    pos, vel, present, moving = np.zeros(c.d), np.zeros(c.d), 0, 0
    for node in s.nodes:
        if node.present:
            present += 1
            pos += s.x[h, node.i_pos : node.i_pos + c.d]
            if not node.static:
                moving += 1
                vel += s.x[h, node.i_vel : node.i_vel + c.d]
    if moving < present:
        vel[:] = 0.0
    return pos / max(present, 1), vel / max(moving, 1)
