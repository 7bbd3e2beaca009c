"""Lever arm: an antenna that is not at the origin of its node.

    l_w = R(q_wb) l_b,    z = u . R_z(psi) l_w,    dz/dpsi = u_1 l_0 - u_0 l_1

with l_b known in the body, psi the heading error of the node, and u the direction of a range; z is
the part of the range that the lever arm of its second end adds.
"""

from __future__ import annotations

from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import cosine_sine, turn


@small_kernel
def antenna_in_world(w, x, y, z, o0, o1, o2):
    """Rotate an antenna position in the body [m] to the world frame by the measured q_wb."""
    # o + 2 w (u x o) + 2 u x (u x o), with u the vector part
    c0, c1, c2 = y * o2 - z * o1, z * o0 - x * o2, x * o1 - y * o0
    return (
        o0 + 2.0 * (w * c0 + y * c2 - z * c1),
        o1 + 2.0 * (w * c1 + z * c0 - x * c2),
        o2 + 2.0 * (w * c2 + x * c1 - y * c0),
    )


@small_kernel
def antenna_offset(held, layout, n, antenna):
    """Return the position of an antenna relative to its node, world frame by measured q_wb [m]."""
    o0, o1, o2 = (
        layout.antenna_b[antenna, 0],
        layout.antenna_b[antenna, 1],
        layout.antenna_b[antenna, 2],
    )
    if o0 == 0.0 and o1 == 0.0 and o2 == 0.0:
        return 0.0, 0.0, 0.0
    return antenna_in_world(held[n, 0], held[n, 1], held[n, 2], held[n, 3], o0, o1, o2)


@small_kernel
def rotate_lever_arm(psi, l0, l1):
    """Correct the horizontal part of a lever arm [m] by the heading error [rad]."""
    return turn(*cosine_sine(psi), l0, l1)


@small_kernel
def lever_arm_slope(l0, l1, u0, u1):
    """Return the derivative of ``u . l`` by the heading error, with l corrected [m/rad]."""
    return u1 * l0 - u0 * l1


@small_kernel
def lever_arm_model(psi, l0, l1, u0, u1):
    """Predict the part of a lever arm in a range [m]; derivative by the heading error [m/rad]."""
    l0, l1 = rotate_lever_arm(psi, l0, l1)
    return u0 * l0 + u1 * l1, lever_arm_slope(l0, l1, u0, u1)
