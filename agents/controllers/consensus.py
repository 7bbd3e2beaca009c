"""Displacement-based formation control on estimates, for cars that cannot move sideways.

Each car moves so that the others come to where they should be [1]:

    u_i = command + k sum_j w_j ((p_j - p_i) - (p_j - p_i)*),   w_j = 1 / (1 + (sigma_j / s)^2)

with estimates that are unsure counting less, plus a push away from cars that are near. The
velocity u becomes a speed along the car and a steering angle by pure pursuit [2].

References:
    [1] Oh, Park, Ahn, A survey of multi-agent formation control, Automatica 53 (2015) 424.
    [2] Coulter, Implementation of the pure pursuit path tracking algorithm, CMU-RI-TR-92-01.
"""

from __future__ import annotations

import numpy as np

from agents.controllers.base import split_fields
from relpos_env.interface.actions import ContinuousActions
from relpos_env.interface.observations import Field
from tracking.arrays import F64

GAIN = 0.8
"""[1/s] Velocity per displacement error."""
MAX_CORRECTION = 0.6
"""[m/s] Largest correction of the commanded velocity."""
TRUSTED_STD = 0.3
"""[m] An estimate as unsure as this counts half."""
KEEP_AWAY = 0.7
"""[m] Nearer than this a car is pushed away from."""
LOOKAHEAD = 0.6
"""[m] Distance of the point pursued."""
WHEELBASE = 0.30
"""[m]"""


class Consensus:
    """Formation by relative displacements; follows the command alone while nothing is known."""

    def __init__(self, fields: tuple[Field, ...]) -> None:
        self._where = split_fields(fields)
        self._limits = ContinuousActions()

    def act(self, observation: F64) -> F64:
        """Speed and steering as shares of their largest values, (2)."""
        part = {name: observation[s].astype(np.float64) for name, s in self._where.items()}
        ok = part["mask"] > 0.5
        pos, target = part["pos"].reshape(-1, 2), part["target"].reshape(-1, 2)
        weight = ok / (1.0 + (part["std"] / TRUSTED_STD) ** 2)
        correction = GAIN * np.sum(weight[:, None] * (pos - target), axis=0) / max(ok.sum(), 1)
        length = np.linalg.norm(correction)
        correction *= min(1.0, MAX_CORRECTION / max(float(length), 1e-9))
        distance = np.linalg.norm(pos, axis=1)
        near = ok * np.maximum(KEEP_AWAY - distance, 0.0) / np.maximum(distance, 0.05)
        wanted = part["command"] + correction - 2.0 * np.sum(near[:, None] * pos, axis=0)

        error = float(np.arctan2(wanted[1], wanted[0]))
        speed = float(np.linalg.norm(wanted)) * max(np.cos(error), 0.25)
        curvature = 2.0 * np.sin(np.clip(error, -np.pi / 2, np.pi / 2)) / LOOKAHEAD
        steering = np.arctan(WHEELBASE * curvature)
        action = [speed / self._limits.max_speed, steering / self._limits.max_steering]
        return np.clip(np.array(action, dtype=np.float32), -1.0, 1.0)
