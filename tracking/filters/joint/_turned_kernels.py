"""What is turned about in space: the offset of its accelerometer, and its tilt.

An offset o turns with the body: it adds ``R(q_wb) o``, and its sums over time are kept beside
those of the acceleration. A horizontal bias b is gravity seen through a tilt of
``(-b_y, b_x, 0) / g``, and what is measured is turned by that tilt as well:

    a_measured = a + b + (b_x a_z, b_y a_z, -b_x a_x - b_y a_y) / g

Without the last part a layout is believed to lean as the orientation of what moves does.
"""

from __future__ import annotations

from tracking._exponential_kernels import decay
from tracking.compiled import small_kernel
from tracking.geometry import GRAVITY

PER_GRAVITY = 1.0 / GRAVITY
"""[s2/m] Tilt by which gravity gives a horizontal acceleration."""


@small_kernel
def measured_motion(node, pre, x, h, i):
    """What the samples of node i add to velocity and way, as measured, its offset taken off."""
    dv0, dv1, dv2 = pre[i, 1], pre[i, 2], pre[i, 3]
    dp0, dp1, dp2 = pre[i, 4], pre[i, 5], pre[i, 6]
    if node.at_o >= 0:
        o0, o1, o2 = x[h, node.at_o], x[h, node.at_o + 1], x[h, node.at_o + 2]
        dv0 -= pre[i, 12] * o0 + pre[i, 13] * o1 + pre[i, 14] * o2
        dv1 -= pre[i, 15] * o0 + pre[i, 16] * o1 + pre[i, 17] * o2
        dv2 -= pre[i, 18] * o0 + pre[i, 19] * o1 + pre[i, 20] * o2
        dp0 -= pre[i, 21] * o0 + pre[i, 22] * o1 + pre[i, 23] * o2
        dp1 -= pre[i, 24] * o0 + pre[i, 25] * o1 + pre[i, 26] * o2
        dp2 -= pre[i, 27] * o0 + pre[i, 28] * o1 + pre[i, 29] * o2
    return dv0, dv1, dv2, dp0, dp1, dp2


@small_kernel
def turn_offset(node, pre, x, h, i, cos_r, sin_r, scale, w):
    """Write to row i of w what an offset adds to velocity and way, and how much of it stays."""
    tilt0, tilt1 = PER_GRAVITY * x[h, node.at_b], PER_GRAVITY * x[h, node.at_b + 1]
    for at in (12, 21):
        for k in range(3):
            o0 = cos_r * pre[i, at + k] - sin_r * pre[i, at + 3 + k]
            o1 = sin_r * pre[i, at + k] + cos_r * pre[i, at + 3 + k]
            o2 = pre[i, at + 6 + k]
            w[i, at - 3 + k], w[i, at + k] = o0 - tilt0 * o2, o1 - tilt1 * o2
            w[i, at + 3 + k] = o2 + tilt0 * o0 + tilt1 * o1
    for k in range(3):
        scale[node.at_o + k] = decay(pre[i, 0] / node.offset_tau)


@small_kernel
def tilt_to_rise(w, i):
    """Derivatives of height and rise by a horizontal bias and the heading, from row i of `step`."""
    g = PER_GRAVITY
    return g * w[i, 6], -g * w[i, 5], g * w[i, 30], g * w[i, 8], -g * w[i, 7], g * w[i, 29]


@small_kernel
def turn_rows(n, node, P, h, i, w):
    """What offset, bias and heading add to the rows of position and velocity of node i."""
    p, v, b, y, at_o = node.at_p, node.at_v, node.at_b, node.at_h, node.at_o
    pb0, pb1, py, vb0, vb1, vy = tilt_to_rise(w, i)
    for k in range(n):
        b0, b1, y0 = P[h, b, k], P[h, b + 1, k], P[h, y, k]
        P[h, p + 2, k] += pb0 * b0 + pb1 * b1 + py * y0
        P[h, v + 2, k] += vb0 * b0 + vb1 * b1 + vy * y0
    for k in range(n):
        o0, o1, o2 = P[h, at_o, k], P[h, at_o + 1, k], P[h, at_o + 2, k]
        for r in range(3):
            at = 9 + 3 * r
            P[h, v + r, k] -= w[i, at] * o0 + w[i, at + 1] * o1 + w[i, at + 2] * o2
            at = 18 + 3 * r
            P[h, p + r, k] -= w[i, at] * o0 + w[i, at + 1] * o1 + w[i, at + 2] * o2


@small_kernel
def turn_columns(node, P, h, i, w):
    """The same for the columns, down to the diagonal."""
    p, v, b, y, at_o = node.at_p, node.at_v, node.at_b, node.at_h, node.at_o
    pb0, pb1, py, vb0, vb1, vy = tilt_to_rise(w, i)
    for r in range(v + 3):
        b0, b1, y0 = P[h, r, b], P[h, r, b + 1], P[h, r, y]
        P[h, r, p + 2] += pb0 * b0 + pb1 * b1 + py * y0
        P[h, r, v + 2] += vb0 * b0 + vb1 * b1 + vy * y0
        o0, o1, o2 = P[h, r, at_o], P[h, r, at_o + 1], P[h, r, at_o + 2]
        for k in range(3):
            at = 9 + 3 * k
            P[h, r, v + k] -= w[i, at] * o0 + w[i, at + 1] * o1 + w[i, at + 2] * o2
            at = 18 + 3 * k
            P[h, r, p + k] -= w[i, at] * o0 + w[i, at + 1] * o1 + w[i, at + 2] * o2
