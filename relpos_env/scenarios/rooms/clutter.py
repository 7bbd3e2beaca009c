"""Sampling of additional obstacles that leave enough space for cars to fit and pass.

An obstacle is in the room, overlaps no other, is clear of the loop or line of the cars and of the
gap, does not divide the free floor, and leaves enough floor for the maximum number of cars. It
is left out if no sampled position meets all conditions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relpos_env.scenarios.layout import track
from relpos_env.scenarios.rooms.floor import Floor, berth
from relpos_env.scenarios.rooms.obstacle import Obstacle, boxes_of
from relpos_env.scenarios.rooms.overlap import beyond_walls, distance, overlap
from tracking.arrays import F64

if TYPE_CHECKING:
    from relpos_env.scenarios.base import Scenario

TRIES = 30
"""[-] Maximum number of positions sampled per obstacle."""
BEFORE_GAP = 1.0
"""[m] Clearance around the opening of a gap, so that a car can line up with it."""


def draw_clutter(
    scenario: Scenario, floor: Floor, n_slots: int, rng: np.random.Generator
) -> tuple[Obstacle, ...]:
    """Sample the additional obstacles of an episode and add them to the floor.

    Args:
        scenario: Scenario with the room, and the number and size of obstacles.
        floor: Floor of the room with its fixed obstacles; the new ones are added.
        n_slots: Number of cars that must still fit.
        rng: Generator of the obstacles.
    """
    what = scenario.randomisation
    placed: list[Obstacle] = []
    for _ in range(int(rng.integers(what.obstacles[0], what.obstacles[1], endpoint=True))):
        width, height = rng.uniform(*what.obstacle_size, 2)
        angle, movable = rng.uniform(0.0, np.pi), bool(rng.random() < what.movable_share)
        half = 0.5 * np.array(scenario.room)
        for x, y in rng.uniform(-half, half, (TRIES, 2)):
            box = Obstacle(x=x, y=y, width=width, height=height, angle=angle, movable=movable)
            row = boxes_of((box,))
            if _is_valid_place(scenario, tuple(placed), row) and _leaves_ways(
                scenario, floor, n_slots, row[0]
            ):
                floor.add(row[0])
                placed.append(box)
                break
    return tuple(placed)


def _is_valid_place(scenario: Scenario, placed: tuple[Obstacle, ...], row: F64) -> bool:
    """Return whether a box is in the room and clear of obstacles, initial poses and the gap."""
    others = boxes_of(scenario.obstacles + placed)
    if beyond_walls(row, scenario.room)[0] or overlap(row, others).any():
        return False
    loop = track(scenario.layout, scenario.ring)
    if len(loop) and distance(loop[:, :2], row[0]).min() < berth(scenario.car):
        return False
    if scenario.gap is None:
        return True
    middle = np.array([scenario.gap.x, scenario.gap.y])
    return bool(distance(middle, row[0]) >= 0.5 * scenario.gap.width + BEFORE_GAP)


def _leaves_ways(scenario: Scenario, floor: Floor, n_slots: int, box: F64) -> bool:
    """Return whether a box leaves the floor connected and large enough."""
    before, _, _ = floor.patches(floor.clearance)
    after, _, size = floor.patches(floor.with_box(box), scenario.start_area)
    return after <= before and floor.room_for(size) >= n_slots
