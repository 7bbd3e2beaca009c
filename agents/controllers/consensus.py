"""Displacement-based formation control on estimates, for cars that cannot move sideways.

Each car moves so that the others come to where they should be [1]:

    u_i = command + k / n sum_j W_j ((p_j - p_i) - (p_j - p_i)*),   W_j = (1 + P_j / s^2)^-1

where an estimate with covariance P counts less in the directions in which it is unsure, and
fully where the observation tells no covariance. A push away from cars that are near is added.
Where nobody has a place, the cars gather at their middle. Trackers find each other by motion: a
car that knows no other and is not sent anywhere drives to and fro. The velocity u becomes a speed
along the car and a steering angle by pure pursuit [2]; what lies behind is pursued backwards, as
if rear were front.

References:
    [1] Oh, Park, Ahn, A survey of multi-agent formation control, Automatica 53 (2015) 424.
    [2] Coulter, Implementation of the pure pursuit path tracking algorithm, CMU-RI-TR-92-01.
"""

from __future__ import annotations

from math import atan, atan2, cos, floor, hypot, pi, radians, sin

import numpy as np

from agents.controllers.base import split_fields
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations import Field
from tracking.arrays import F64, Bool

GAIN = 0.8
"""[1/s] Velocity per displacement error."""
MAX_CORRECTION = 0.6
"""[m/s] Largest correction of the commanded velocity."""
TRUSTED_STD = 0.3
"""[m] An estimate counts half in a direction in which it is as unsure as this."""
KEEP_AWAY = 0.7
"""[m] Nearer than this a car is pushed away from."""
PUSH = 2.0
"""[1/s] Velocity per distance missing."""
REVERSE_FROM = radians(110.0)
"""[rad] What is wanted farther off the bow is driven to backwards."""
STANDING = 0.05
"""[m/s] Wanted velocities below this are none: the car stands."""
SEARCH_BELOW, SEARCH_SPEED = 0.3, 0.6
"""[m/s] A car that knows nobody and is sent nowhere faster than the first searches at the other."""
SEARCH_ARC = pi / 4
"""[rad] Turned by so much, a searching car changes its gear; an even part of a full turn."""
LOOKAHEAD = 0.6
"""[m] Distance of the point pursued."""
WHEELBASE = 0.30
"""[m]"""


class Consensus:
    """Formation by relative displacements; follows the command alone while nothing is known."""

    def __init__(self, fields: tuple[Field, ...]) -> None:
        self._where = split_fields(fields)

    def act(self, observation: F64) -> F64:
        """Speed and steering as shares of their largest values, (2)."""
        part = {name: observation[s].astype(np.float64) for name, s in self._where.items()}
        wanted = part["command"]
        if "pos" in part:
            ok, pos = part["mask"] > 0.5, part["pos"].reshape(-1, 2)
            if not ok.any() and hypot(*wanted) < SEARCH_BELOW and part["heading"].any():
                return search(*part["heading"].tolist())
            wanted = wanted + correction(part, ok, pos) + push(ok, pos)
        return drive(*wanted.tolist())


def correction(part: dict[str, F64], ok: Bool, pos: F64) -> F64:
    """Velocity that brings the others to their places, (2) [m/s].

    Args:
        part: The stretches of an observation.
        ok: Which of the others are known, (other).
        pos: Where they are, (other, 2) [m].
    """
    placed = part["wanted"] > 0.5
    # Without places, as at a rendezvous, all should be where this car is.
    used = ok & placed if placed.any() else ok
    error = (pos - part["target"].reshape(-1, 2))[used]
    if "std" in part:
        error = _cautious(error, part["std"].reshape(-1, 3)[used])
    velocity: F64 = GAIN * error.sum(axis=0) / max(len(error), 1)
    return velocity * min(1.0, MAX_CORRECTION / max(hypot(*velocity), 1e-9))


def push(ok: Bool, pos: F64) -> F64:
    """Velocity away from the known others that are near, (2) [m/s]."""
    distance = np.linalg.norm(pos, axis=1)
    near = ok * np.maximum(KEEP_AWAY - distance, 0.0) / np.maximum(distance, 0.05)
    velocity: F64 = -PUSH * (near[:, None] * pos).sum(axis=0)
    return velocity


def search(cosine: float, sine: float) -> F64:
    """The action of a car with this heading that turns in little room, to and fro."""
    gear = 1.0 if floor(atan2(sine, cosine) / SEARCH_ARC) % 2 == 0 else -1.0
    return np.array([gear * SEARCH_SPEED / MAX_SPEED, gear], dtype=np.float32)


def drive(ahead: float, left: float) -> F64:
    """The action of a car that wants a velocity [m/s]."""
    speed = hypot(ahead, left)
    if speed < STANDING:
        return np.zeros(2, dtype=np.float32)
    error, gear = atan2(left, ahead), 1.0
    if abs(error) > REVERSE_FROM:
        # To go backwards along a circle the wheels point to the side on which its middle is.
        error, gear = atan2(left, -ahead), -1.0
    curvature = 2.0 * sin(min(max(error, -pi / 2), pi / 2)) / LOOKAHEAD
    share = gear * speed * max(cos(error), 0.25) / MAX_SPEED
    action = [share, atan(WHEELBASE * curvature) / MAX_STEERING]
    return np.clip(np.array(action, dtype=np.float32), -1.0, 1.0)


def _cautious(error: F64, std: F64) -> F64:
    """Displacement errors by how sure they are, (other, 2) [m].

    Args:
        error: (other, 2) [m]
        std: Standard deviations ahead and to the left [m], and their correlation, (other, 3).
    """
    ahead, left, mixed = std.T / TRUSTED_STD
    a, d = 1.0 + ahead**2, 1.0 + left**2
    b = std[:, 2] * ahead * left
    weighted = np.stack([d * error[:, 0] - b * error[:, 1], a * error[:, 1] - b * error[:, 0]])
    shares: F64 = (weighted / (a * d - b**2)).T
    return shares
