"""Motion of cars in the second world: random target speeds and curvatures, kinematic bicycles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

HZ = 200.0
"""[Hz] Rate of the integration."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Position of a tracker and yaw of its car as functions of time."""

    place: CubicSpline
    """[m] Position (x, y)."""
    yaw: CubicSpline
    """[rad] Yaw."""

    def turns(self, t):
        """Return the rotations from body to world, (time,)."""
        return Rotation.from_euler("Z", self.yaw(t)[:, None])

    def rates(self, t):
        """Return the angular velocity in the body, (time, 3) [rad/s]."""
        return np.column_stack([np.zeros((len(t), 2)), self.yaw(t, 1)])


def drive(world, rng) -> list[Motion]:
    """Simulate the motion of every car of a world, 0.5 s longer than the run."""
    t = np.arange(int((world.seconds + 0.5) * HZ)) / HZ
    n = len(world.vehicles)
    top = np.array([v.top_speed for v in world.vehicles])
    limit = np.array([v.acceleration for v in world.vehicles])
    sharpest = np.tan(0.5) / np.array([v.wheelbase for v in world.vehicles])
    at = rng.uniform(-0.5, 0.5, (n, 2)) * world.radius + 0.3 * np.arange(n)[:, None]
    yaw, speed, bend = rng.uniform(-np.pi, np.pi, n), np.zeros(n), np.zeros(n)
    wanted, wanted_bend, until = np.zeros(n), np.zeros(n), world.at_rest + rng.uniform(0, 1, n)
    places, yaws = np.empty((len(t), n, 2)), np.empty((len(t), n))
    push = np.zeros(n)
    for k, now in enumerate(t):
        places[k], yaws[k] = at, yaw
        for i in np.nonzero(now >= until)[0]:
            until[i] = now + rng.uniform(0.7, 4.0)
            stands = rng.random() < 0.12
            wanted[i] = 0.0 if stands else rng.uniform(0.25, 1.0) * top[i]
            wanted_bend[i] = rng.uniform(-1.0, 1.0) * sharpest[i]
        # Cars outside the radius turn back.
        away = np.linalg.norm(at, axis=1)
        home = np.arctan2(-at[:, 1], -at[:, 0]) - yaw
        home = np.arctan2(np.sin(home), np.cos(home))
        curve = np.where(away > world.radius, 2.0 * home / np.maximum(speed, 0.3), wanted_bend)
        grip = limit / np.maximum(speed, 0.3) ** 2
        curve = np.clip(curve, -np.minimum(sharpest, grip), np.minimum(sharpest, grip))
        force = np.clip(4.0 * (wanted - speed), -limit, limit)
        push += (force - push) / (0.1 * HZ)
        bend += (curve - bend) / (0.15 * HZ)
        speed = np.maximum(speed + push / HZ, 0.0)
        middle = yaw + 0.5 * bend * speed / HZ
        at = at + (speed / HZ)[:, None] * np.stack([np.cos(middle), np.sin(middle)], -1)
        yaw = yaw + bend * speed / HZ
    motions = []
    for i, v in enumerate(world.vehicles):
        c, s = np.cos(yaws[:, i]), np.sin(yaws[:, i])
        arm = np.stack([v.ahead * c - v.aside * s, v.ahead * s + v.aside * c], axis=-1)
        motions.append(Motion(CubicSpline(t, places[:, i] + arm), CubicSpline(t, yaws[:, i])))
    return motions
