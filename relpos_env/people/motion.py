"""Motion of a body: smooth splines through sampled positions and orientations.

Positions are interpolated by quintic splines, so that the acceleration is their second
derivative and itself smooth. A quaternion is a normalised quintic spline s(t) in each
component, and the angular rate follows from it [1]:

    q = s / |s|,    rate_b = 2 vec(q* dq/dt),    dq/dt = (ds/dt - (q . ds/dt) q) / |s|

References:
    [1] Sola, Quaternion kinematics for the error-state Kalman filter, 2017, eq. 200.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from relpos_env.errors import EnvError
from tracking.arrays import F64, Bool
from tracking.geometry import quat_conjugate, quat_multiply
from tracking.params.short_repr import short_repr

HIDING = ("trunk", "head")
"""Limbs that occlude the radio. Arms and legs, 8 cm to 16 cm thick, are narrower than the first
Fresnel zone, 17 cm to 21 cm across halfway along 0.6 m at 6.5 GHz to 4 GHz: waves are diffracted
around them with little loss and hardly any detour."""
SITES = ("right upper arm", "right wrist", "right hip", "left wrist", "right knee", "left knee")
"""Sites of the trackers (Armani and Holz, ICRA 2024), in the order of the nodes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BodySamples:
    """Samples of a body at evenly spaced times."""

    __repr__ = short_repr

    t: F64
    """Times, (time) [s]."""
    pos_w: F64
    """Positions of the trackers, (time, site, 3) [m]."""
    q_wb: F64
    """Orientations of the trackers, segment to world, (time, site, 4)."""
    start_w: F64
    """One end of the axis of each limb, a capsule, (time, limb, 3) [m]."""
    end_w: F64
    """Other end of the axis of each limb, (time, limb, 3) [m]."""
    radius: F64
    """Radius of the limbs, (limb) [m]."""
    hides: Bool
    """True for limbs that occlude the radio, (limb)."""


@dataclass(frozen=True, slots=True)
class BodyState:
    """State of the trackers at some times."""

    __repr__ = short_repr

    pos_w: F64
    """Position, (time, site, 3) [m]."""
    vel_w: F64
    """Velocity, (time, site, 3) [m/s]."""
    accel_w: F64
    """Acceleration, (time, site, 3) [m/s2]."""
    q_wb: F64
    """Orientation, body to world, (time, site, 4)."""
    rate_b: F64
    """Angular rate in the body frame, (time, site, 3) [rad/s]."""


class BodyMotion:
    """Motion of a body over a run.

    Property: speed, acceleration and angular rate are the derivatives of position and orientation.
    """

    def __init__(self, samples: BodySamples) -> None:
        """Fit the splines.

        Args:
            samples: At least six samples, all finite.

        Raises:
            EnvError: There are too few samples, or some are not finite.
        """
        if len(samples.t) < 6 or not all(
            np.isfinite(a).all() for a in (samples.pos_w, samples.q_wb, samples.start_w)
        ):
            raise EnvError("body: expected at least 6 samples, all finite")
        self._samples = samples
        self._pos: BSpline = make_interp_spline(samples.t, samples.pos_w, k=5)
        self._quat: BSpline = make_interp_spline(samples.t, one_sided(samples.q_wb), k=5)

    @property
    def duration(self) -> float:
        """Time of the end of the motion [s]."""
        return float(self._samples.t[-1])

    @property
    def n_sites(self) -> int:
        """Number of trackers."""
        return int(self._samples.pos_w.shape[1])

    def at(self, t: F64) -> BodyState:
        """Return the state of the trackers at times from 0 to `duration`, (time) [s]."""
        s, ds = self._quat(t), self._quat(t, 1)
        length = np.linalg.norm(s, axis=-1, keepdims=True)
        q = s / length
        dq = (ds - np.sum(q * ds, axis=-1, keepdims=True) * q) / length
        rate = 2.0 * quat_multiply(quat_conjugate(q), dq)[..., 1:]
        return BodyState(self._pos(t), self._pos(t, 1), self._pos(t, 2), q, rate)

    def limbs(self, t: F64) -> F64:
        """Return the limbs, interpolated linearly between samples.

        Args:
            t: Times from 0 to `duration`, (time) [s].

        Returns:
            Both ends of the axis and the radius, (time, limb, 7) [m].
        """
        grid = self._samples.t
        before = np.clip(np.searchsorted(grid, t, side="right") - 1, 0, len(grid) - 2)
        share = ((t - grid[before]) / (grid[before + 1] - grid[before]))[:, None, None]
        ends = [
            (1.0 - share) * end[before] + share * end[before + 1]
            for end in (self._samples.start_w, self._samples.end_w)
        ]
        radius = np.broadcast_to(self._samples.radius[:, None], (*ends[0].shape[:2], 1))
        return np.concatenate([*ends, radius], axis=-1)

    def obstacles(self, t: F64) -> F64:
        """Return the limbs that occlude the radio, as `limbs` does."""
        return self.limbs(t)[:, self._samples.hides]


def one_sided(q: F64) -> F64:
    """Return the same orientations with continuous signs, (time, ..., 4)."""
    same = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True) >= 0.0
    sign = np.cumprod(np.where(same, 1.0, -1.0), axis=0)
    return np.concatenate([q[:1], q[1:] * sign])
