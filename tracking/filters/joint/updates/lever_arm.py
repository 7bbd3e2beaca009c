"""Antennas that are not at the origin of their nodes: where they are, and what a turn does to them.

Offsets are known in the body, so they are turned by the orientation of the node, as accelerations
are: while it is open how the group is turned (`alignment_sensitivity`), they turn with M.
"""

from __future__ import annotations

from tracking.filters.joint.ekf.propagation import moves
from tracking.kernels.jit import small_kernel
from tracking.models.lever_arm import antenna_in_world


@small_kernel
def antenna_offset(held, layout, n, antenna):
    """Position of an antenna relative to its node, world frame as measured [m]."""
    o0, o1, o2 = (
        layout.antenna_b[antenna, 0],
        layout.antenna_b[antenna, 1],
        layout.antenna_b[antenna, 2],
    )
    if o0 == 0.0 and o1 == 0.0 and o2 == 0.0:
        return 0.0, 0.0, 0.0
    return antenna_in_world(held[n, 0], held[n, 1], held[n, 2], held[n, 3], o0, o1, o2)


@small_kernel
def lever_arm_sensitivity(levers, work):
    """Derivatives of a range by the turn, the positions held: only its antennas turn with M."""
    u, direct = work.val, work.direct
    for k in range(3):
        lever = levers[3 + k] - levers[k]
        direct[k], direct[3 + k], direct[6 + k] = u[2] * lever, u[3] * lever, u[5] * lever


@small_kernel
def attach_to_world(s, layout, h):
    """Sensitivities of what was estimated while hypothesis h had its present rotation.

    Ranges measure where the antenna of a node is in the frame, whatever M is: its origin is an
    offset away that turns with M. So does a bias of the accelerations, which is one of the world.
    With both the same for all M, ranges and rest would measure a rotation that they do not observe.
    """
    s.sensitivity[h] = 0.0
    for i in range(s.nodes.shape[0]):
        node = s.nodes[i]
        if not node.present:
            continue
        offset = antenna_offset(s.last_attitude_accel, layout, i, node.antenna)
        for r in range(3):
            for q in range(3):
                s.sensitivity[h, 3 * r + q, node.i_pos + r] = -offset[q]
                if moves(node) and not node.levelled:
                    s.sensitivity[h, 3 * r + q, node.i_tilt_bias + r] = s.x[h, node.i_tilt_bias + q]
