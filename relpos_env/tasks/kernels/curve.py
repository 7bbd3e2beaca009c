"""A point of a curve and its derivatives, compiled."""

from __future__ import annotations

from tracking.kernels.jit import small_kernel


@small_kernel
def curve_point(curve, length, s):
    """Return the point of a curve at an arc length, and its first and second derivatives.

    Args:
        curve: Coefficients of x and y, falling powers, (segment, 2, 4).
        length: Length of the curve [m], more than 0.
        s: Arc length from the beginning [m], 0 to length.

    Returns:
        x, y [m], x', y' [-], x'', y'' [1/m].
    """
    knot = length / curve.shape[0]
    segment = min(int(s / knot), curve.shape[0] - 1)
    u = s - segment * knot
    a, b = curve[segment, 0, 0], curve[segment, 0, 1]
    c, d = curve[segment, 0, 2], curve[segment, 0, 3]
    x = ((a * u + b) * u + c) * u + d
    d_x = (3.0 * a * u + 2.0 * b) * u + c
    dd_x = 6.0 * a * u + 2.0 * b
    a, b = curve[segment, 1, 0], curve[segment, 1, 1]
    c, d = curve[segment, 1, 2], curve[segment, 1, 3]
    y = ((a * u + b) * u + c) * u + d
    d_y = (3.0 * a * u + 2.0 * b) * u + c
    dd_y = 6.0 * a * u + 2.0 * b
    return x, y, d_x, d_y, dd_x, dd_y
