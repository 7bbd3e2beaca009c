"""Heading of a vehicle, and the acceleration of a vehicle that stays level.

This acceleration is free of the tilt error of the orientation.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel
from tracking.maths.elementary import turn

GRAVITY = 9.81


@small_kernel
def direction(w, x, y, z):
    """Return cosine and sine of the yaw of a quaternion q_wb."""
    c, s = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    length = math.sqrt(c * c + s * s)
    return (c / length, s / length) if length > 0.0 else (1.0, 0.0)


@small_kernel
def angle_between(cos_a, sin_a, cos_b, sin_b):
    """Return the angle from one direction to another, -pi to pi [rad]; small ones by a series."""
    c, s = cos_a * cos_b + sin_a * sin_b, cos_a * sin_b - sin_a * cos_b
    if c > 0.0 and abs(s) < 0.05:
        q = s * s  # arc sine, to 1e-11
        return s * (1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * (15.0 / 336.0))))
    return math.atan2(s, c)


@small_kernel
def level(w, x, y, z, a0, a1, a2, cos_yaw, sin_yaw):
    """Return the horizontal acceleration of a body that is assumed to be level.

    The specific force in the body, ``f = R^T (a + g)``, has no error of the orientation;
    rotated by the yaw alone it is the acceleration of a car or robot on a floor. A tilt error
    of half a degree would add 0.09 m/s2.

    Args:
        w: Quaternion q_wb, w.
        x: Quaternion q_wb, x.
        y: Quaternion q_wb, y.
        z: Quaternion q_wb, z.
        a0: Acceleration along x, world frame [m/s2].
        a1: Acceleration along y, world frame [m/s2].
        a2: Acceleration along z, world frame [m/s2].
        cos_yaw: Cosine of the quaternion's yaw (`direction`).
        sin_yaw: Sine of the quaternion's yaw.

    Returns:
        The two horizontal accelerations, world frame [m/s2].
    """
    f0 = (1.0 - 2.0 * (y * y + z * z)) * a0 + 2.0 * (x * y + w * z) * a1
    f0 += 2.0 * (x * z - w * y) * (a2 + GRAVITY)
    f1 = 2.0 * (x * y - w * z) * a0 + (1.0 - 2.0 * (x * x + z * z)) * a1
    f1 += 2.0 * (y * z + w * x) * (a2 + GRAVITY)
    return turn(cos_yaw, sin_yaw, f0, f1)
