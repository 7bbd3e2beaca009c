"""Initial poses of the cars of a scenario: on a loop, on a line, or scattered."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from relpos_env.scenarios.rooms.overlap import SKIN, beyond_walls, car_boxes, overlap
from relpos_env.world.car import CarParams
from tracking.arrays import F64

Layout = Literal["ring", "line", "scattered"]
LAYOUTS = ("ring", "line", "scattered")

DISORDER = 0.1
"""[spacings, rad] Maximum random offset of positions on the loop and of headings."""
TRIES = 100
"""[-] Maximum number of attempts to sample poses on a crowded loop."""


def ring_poses(n: int, ring: tuple[float, float], car: CarParams, rng: np.random.Generator) -> F64:
    """Sample evenly spaced poses along a loop with random offsets, (car, 3) [m, m, rad].

    Args:
        n: Number of cars.
        ring: Half axes of the loop [m].
        car: Parameters with the size of the cars.
        rng: Generator of phase and offsets.
    """
    spacing = 2.0 * np.pi / n
    for _ in range(TRIES):
        phase = rng.uniform(0.0, 2.0 * np.pi) + spacing * np.arange(n, dtype=np.float64)
        phase += rng.uniform(-DISORDER, DISORDER, n) * spacing
        poses = on_loop(ring, phase)
        poses[:, 2] += rng.uniform(-DISORDER, DISORDER, n)
        if clear_of_each_other(poses, car, 0.01):
            return poses
    return on_loop(ring, spacing * np.arange(n, dtype=np.float64))


def line_poses(n: int, ring: tuple[float, float], rng: np.random.Generator) -> F64:
    """Sample evenly spaced poses on a line next to the centre, (car, 3) [m, m, rad].

    The line is `x = ring[0]` with the length of the loop along y; only the headings are random.
    """
    a, b = ring
    y = (np.arange(n) - 0.5 * (n - 1)) * 2.0 * b / n
    heading = 0.5 * np.pi + rng.uniform(-DISORDER, DISORDER, n)
    return np.stack([np.full(n, a), y, heading], axis=1)


def on_loop(ring: tuple[float, float], phase: F64) -> F64:
    """Return poses along a loop, counter-clockwise, (phase, 3) [m, m, rad]."""
    a, b = ring
    heading = np.arctan2(b * np.cos(phase), -a * np.sin(phase))
    return np.stack([a * np.cos(phase), b * np.sin(phase), heading], axis=1)


def track(layout: Layout, ring: tuple[float, float]) -> F64:
    """Return dense poses along the loop or line of initial poses, (pose, 3); none if scattered."""
    a, b = ring
    n = max(64, int(2.0 * math.pi * max(ring) / 0.2))
    if layout == "ring":
        return on_loop(ring, 2.0 * np.pi / n * np.arange(n, dtype=np.float64))
    if layout == "line":
        y = np.linspace(-b, b, n)
        return np.stack([np.full(n, a), y, np.full(n, 0.5 * np.pi)], axis=1)
    return np.zeros((0, 3))


def most_cars(layout: Layout, ring: tuple[float, float], car: CarParams) -> int:
    """Return the maximum number of cars on a loop or a line."""
    if layout == "line":
        return int(2.0 * ring[1] / (1.2 * car.length))
    most = int(np.pi * sum(ring) / (1.5 * car.length))
    # Even phases are not even distances on an elongated loop, so cars can touch at its bends.
    while most >= 2 and not _fit_on_loop(min(most, 100), ring, car):
        most = min(most, 100) - 1
    return most


def _fit_on_loop(n: int, ring: tuple[float, float], car: CarParams) -> bool:
    even = 2.0 * np.pi / n * np.arange(n, dtype=np.float64)
    shifts = (0.0, 0.25 * np.pi / n, 0.5 * np.pi / n)
    return all(clear_of_each_other(on_loop(ring, even + shift), car) for shift in shifts)


def clear_of_each_other(poses: F64, car: CarParams, margin: float = SKIN) -> bool:
    """Return whether no two cars, enlarged by a margin [m] on every side, overlap."""
    boxes = car_boxes(poses, car, margin)
    return int(overlap(boxes, boxes).sum()) == len(poses)


def first_in_the_way(poses: F64, car: CarParams, room: tuple[float, float], boxes: F64) -> int:
    """Return the index of the first box that overlaps a car; -1 for a wall, -2 for none."""
    taken = car_boxes(poses, car, 2.0 * SKIN)
    if beyond_walls(taken, room).any():
        return -1
    hit = overlap(taken, boxes).any(axis=0)
    return int(hit.argmax()) if hit.any() else -2
