"""Acceleration of a carrier that stays level, free of the tilt that its orientation errs by."""

from __future__ import annotations

import math

from tracking.compiled import small_kernel

GRAVITY = 9.81


@small_kernel
def level(w, x, y, z, a0, a1, a2):
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

    Returns:
        The two horizontal accelerations, world frame [m/s2].
    """
    f0 = (1.0 - 2.0 * (y * y + z * z)) * a0 + 2.0 * (x * y + w * z) * a1
    f0 += 2.0 * (x * z - w * y) * (a2 + GRAVITY)
    f1 = 2.0 * (x * y - w * z) * a0 + (1.0 - 2.0 * (x * x + z * z)) * a1
    f1 += 2.0 * (y * z + w * x) * (a2 + GRAVITY)
    yaw = math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return math.cos(yaw) * f0 - math.sin(yaw) * f1, math.sin(yaw) * f0 + math.cos(yaw) * f1
