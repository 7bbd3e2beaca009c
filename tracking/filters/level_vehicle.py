"""Which way a carrier points, and the acceleration of one that stays level.

The latter is free of the tilt that its orientation errs by.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.maths.angles import turn

GRAVITY = 9.81


@small_kernel
def direction(w, x, y, z):
    """Cosine and sine of the yaw of a quaternion q_wb."""
    c, s = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    length = math.sqrt(c * c + s * s)
    return (c / length, s / length) if length > 0.0 else (1.0, 0.0)


@small_kernel
def angle_between(cos_a, sin_a, cos_b, sin_b):
    """Angle from one direction to another, -pi to pi [rad]; small ones without a library."""
    c, s = cos_a * cos_b + sin_a * sin_b, cos_a * sin_b - sin_a * cos_b
    if c > 0.0 and abs(s) < 0.05:
        q = s * s  # arc sine, to 1e-11
        return s * (1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * (15.0 / 336.0))))
    return math.atan2(s, c)


@small_kernel
def level(w, x, y, z, a0, a1, a2, cos_yaw, sin_yaw):
    """Horizontal acceleration, the body taken as level.

    The specific force in the body, ``f = R^T (a + g)``, holds no error of the orientation;
    turned by the yaw alone it is the acceleration of a car or robot on a floor. A tilt error
    of half a degree would add 0.09 m/s2.

    Args:
        w: Quaternion q_wb.
        x: Quaternion.
        y: Quaternion.
        z: Quaternion.
        a0: Acceleration, world frame [m/s2].
        a1: The same.
        a2: The same.
        cos_yaw: Of the quaternion's yaw (`direction`).
        sin_yaw: The same.

    Returns:
        The two horizontal accelerations, world frame [m/s2].
    """
    f0 = (1.0 - 2.0 * (y * y + z * z)) * a0 + 2.0 * (x * y + w * z) * a1
    f0 += 2.0 * (x * z - w * y) * (a2 + GRAVITY)
    f1 = 2.0 * (x * y - w * z) * a0 + (1.0 - 2.0 * (x * x + z * z)) * a1
    f1 += 2.0 * (y * z + w * x) * (a2 + GRAVITY)
    return turn(cos_yaw, sin_yaw, f0, f1)
