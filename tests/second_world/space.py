"""Motion of hands, drones and bodies in the second world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

G = 9.81
SITES = np.array(
    [[0, 0, 1.0], [0.1, 0, 1.6], [0.1, 0.35, 1.0], [0.1, -0.35, 1.0], [0, 0.12, 0.5],
     [0, -0.12, 0.5]]
)  # fmt: skip
"""[m] Waist, head, wrists and knees of an upright body."""
REACH = np.array([0.02, 0.08, 0.35, 0.35, 0.2, 0.2])
"""[m] Amplitude of the swing of a site."""
BETWEEN = {"hand": (0.5, 1.6), "drone": (1.0, 3.0), "human": (1.0, 3.0)}
"""[s] Range of the time between two waypoints of a path."""


@dataclass(frozen=True, slots=True)
class Flight:
    """Position and orientation of a tracker as functions of time."""

    place: CubicSpline
    """[m] Position (x, y, z)."""
    turn: RotationSpline

    def turns(self, t):
        """Return the rotations from body to world, (time,)."""
        return self.turn(t)

    def rates(self, t):
        """Return the angular velocity in the body, (time, 3) [rad/s]."""
        return self.turn(t, 1)


def fly(world, rng) -> list[Flight]:
    """Simulate the motion of every node of a world, one second longer than the run."""
    if world.kind == "human":
        return _body(world, rng)
    return [_one(world, vehicle, rng) for vehicle in world.vehicles]


def _knots(world, rng):
    """Return times of waypoints [s], dense at rest, and the number of waypoints at rest."""
    t = list(np.arange(-1.0, world.at_rest + 0.1, 0.1))
    n_rest = len(t)
    while t[-1] < world.seconds + 1.5:
        t.append(t[-1] + rng.uniform(*BETWEEN[world.kind]))
    return np.array(t), n_rest


def _path(world, vehicle, rng, knots, n_rest):
    """Return waypoints within the top speed of the vehicle, (knot, 3) [m]."""
    ceiling = np.array([world.radius, world.radius, 2.5])
    floor = np.array([-world.radius, -world.radius, 0.3])
    at = rng.uniform(0.6 * floor, 0.6 * ceiling)
    places = [at] * n_rest
    for dt in np.diff(knots)[n_rest - 1 :]:
        goal = rng.uniform(floor, ceiling)
        far = np.linalg.norm(goal - at)
        at = at + (goal - at) * min(1.0, vehicle.top_speed * dt * rng.uniform(0.2, 0.8) / far)
        places.append(at)
    return np.array(places)


def _one(world, vehicle, rng):
    knots, n_rest = _knots(world, rng)
    place = CubicSpline(knots, _path(world, vehicle, rng, knots, n_rest))
    yaw = _yaw(rng, knots, n_rest, 0.7)
    if world.kind == "hand":
        tip = np.radians(25.0) * rng.normal(size=(len(knots), 2))
        tip[:n_rest] = tip[0]
        return Flight(place, RotationSpline(knots, Rotation.from_euler("ZYX", np.c_[yaw, tip])))
    # A drone's thrust is along its own z axis.
    t = np.arange(knots[0], knots[-1], 0.05)
    thrust = place(t, 2) + [0.0, 0.0, G]
    up = thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
    axis = np.cross([0.0, 0.0, 1.0], up)
    lean = np.arcsin(np.clip(np.linalg.norm(axis, axis=1, keepdims=True), 1e-12, 1.0))
    tilt = Rotation.from_rotvec(axis / np.sin(lean) * lean)
    heading = CubicSpline(knots, yaw)(t)[:, None]
    return Flight(place, RotationSpline(t, tilt * Rotation.from_euler("Z", heading)))


def _yaw(rng, knots, n_rest, step):
    """Return yaws of a random walk that begins after the time at rest, (knot,) [rad]."""
    steps = rng.normal(0.0, step, len(knots))
    steps[:n_rest] = 0.0
    return rng.uniform(-np.pi, np.pi) + np.cumsum(steps)


def _body(world, rng):
    """Return the motions of six sites of a body that walks and swings its limbs."""
    knots, n_rest = _knots(world, rng)
    path = CubicSpline(knots, _path(world, world.vehicles[0], rng, knots, n_rest) * [1.0, 1.0, 0.0])
    heading = CubicSpline(knots, _yaw(rng, knots, n_rest, 0.5))
    t = np.arange(knots[0], knots[-1], 0.04)
    moves = np.clip((t - world.at_rest) / 0.5, 0.0, 1.0)[:, None]
    body = Rotation.from_euler("Z", heading(t)[:, None])
    flights = []
    for site, reach in zip(SITES, REACH, strict=True):
        swing = np.zeros((len(t), 3))
        tip = np.zeros((len(t), 3))
        for _ in range(3):
            rate, phase = 2.0 * np.pi * rng.uniform(0.3, 1.5), rng.uniform(0.0, 2.0 * np.pi, 3)
            swing += reach / 2.0 * rng.uniform(0.0, 1.0, 3) * np.sin(rate * t[:, None] + phase)
            tip += (
                np.radians(60.0)
                * reach
                * rng.uniform(-1.0, 1.0, 3)
                * np.sin(rate * t[:, None] + phase)
            )
        place = path(t) + body.apply(site + moves * swing)
        held = Rotation.from_euler("ZYX", np.radians(20.0) * rng.normal(size=3))
        turns = body * Rotation.from_rotvec(moves * tip) * held
        flights.append(Flight(CubicSpline(t, place), RotationSpline(t, turns)))
    return flights
