"""Process noise of saturated accelerations.

A saturated reading is nearer to the acceleration than none. So it is preintegrated like any other,
with the process noise of a node without an IMU.
"""

from __future__ import annotations

from tracking.jit import small_kernel

IN_PLANE = 2.0
"""A cut-off of more than what is along the body's z."""


@small_kernel
def add_saturation_noise(c, node, pre, i, t, cut_off):
    """Add the noise of the time since node i's last state, if it was cut off at either end.

    Args:
        c: Coefficients.
        node: NODE of it, before the state is taken; updated.
        pre: Sums over inertial samples; the square of the acceleration, which carries the noise
            that is not constant, grows by what amounts to that of an unheard IMU.
        i: Its index.
        t: Time of the state [s].
        cut_off: How much of its acceleration means nothing, see `Kind.STATE`.
    """
    # A carrier that stays level does not need what is across its plane.
    now = cut_off >= IN_PLANE or (cut_off > 0.0 and not node.levelled)
    if (now or node.saturated) and node.has_state:
        dt = min(max(t - node.t_state, 0.0), c.imu_timeout)
        pre[i, 11] += dt * c.unaided_psd2
    node.saturated = now
