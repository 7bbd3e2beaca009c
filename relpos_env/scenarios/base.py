"""Scenario: the complete description of a world except its seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.scenarios.checks import check_scenario, most_that_start
from relpos_env.scenarios.layout import Layout, line_poses, ring_poses
from relpos_env.scenarios.levels import level
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.scenarios.rooms.floor import Area, Floor
from relpos_env.scenarios.rooms.gap import Gap
from relpos_env.scenarios.rooms.obstacle import Obstacle, boxes_of
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.proximity import ProximitySimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.world.car import CarParams
from tracking.arrays import F64
from tracking.mount import Mount

Furnish = Callable[[Any, np.random.Generator], None]
"""``(relpos_env.world.pymunk_space.PhysicsSpace, generator)``"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A room with obstacles, cars and sensors, and the randomisation of its episodes."""

    name: str
    room: tuple[float, float]
    """[m] Size along x and y; the origin is the centre."""
    obstacles: tuple[Obstacle, ...] = ()
    """Obstacles of every episode."""
    gap: Gap | None = None
    """Gap in a wall to drive through; the wall is one of the obstacles.
    `with_gap` sets both."""
    n_cars: int = 3
    n_cars_range: tuple[int, int] = (2, 20)
    """[-] Permitted minimum and maximum number of cars."""
    ring: tuple[float, float]
    """[m] Half axes of the loop on which the cars start and drive round the centre."""
    layout: Layout = "ring"
    """Initial positions of the cars: `ring`, evenly on the loop; `line`, on a straight line next
    to the centre, at x = ring[0]; `scattered`, random positions and headings."""
    start_area: Area | None = None
    """[m] Minimum x, minimum y, maximum x, maximum y of initial positions of scattered and joining
    cars; None is the whole room."""
    in_line: bool = field(default=False, repr=False, metadata={"in_file": False})
    """Constructor argument equivalent to `layout="line"`; always False when read."""
    car: CarParams = field(default_factory=CarParams)
    mounts: tuple[Mount, ...] = ()
    """Mounts of the trackers of the first cars, which the tracker is given. An `ahead` that is
    left out is drawn and estimated, as all of the other cars."""
    imu: ImuSimParams = field(default_factory=ImuSimParams)
    mag: MagSimParams = field(default_factory=MagSimParams)
    odometer: OdometerSimParams = field(default_factory=OdometerSimParams)
    proximity: ProximitySimParams = field(default_factory=ProximitySimParams)
    """Distance sensors, used by environments with `proximity`."""
    radio: RadioSimParams = field(default_factory=RadioSimParams)
    furnish: Furnish | None = field(default=None, repr=False, metadata={"in_file": False})
    """Function that adds bodies, shapes, joints and collision handlers to the space, sampled from
    the generator; needs ``physics="pymunk"``. In a file ``package.module:name``."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """Randomisation of every episode; none by default."""

    def __post_init__(self) -> None:
        if self.in_line:
            object.__setattr__(self, "layout", "line")
            object.__setattr__(self, "in_line", False)
        check_scenario(self)

    @property
    def most_cars(self) -> int:
        """Maximum number of cars present at a time."""
        drawn = self.randomisation.n_cars
        return self.n_cars if drawn is None else drawn[1]

    @property
    def max_boxes(self) -> int:
        """Maximum number of obstacles of an episode."""
        return len(self.obstacles) + self.randomisation.obstacles[1]

    def with_cars(self, n_cars: int) -> Scenario:
        """Return a copy with another number of cars, or another maximum if it is sampled.

        Raises:
            EnvError: The cars do not fit.
        """
        drawn = self.randomisation.n_cars
        if drawn is None:
            return replace(self, n_cars=n_cars)
        if n_cars < drawn[0]:
            raise EnvError(
                f"n_cars: expected at least {drawn[0]}, the fewest that are drawn, got {n_cars}"
            )
        drawn = (drawn[0], min(drawn[1], n_cars))
        return replace(
            self,
            n_cars=min(self.n_cars, n_cars),
            randomisation=replace(self.randomisation, n_cars=drawn),
        )

    def start(self, rng: np.random.Generator, n_cars: int | None = None) -> F64:
        """Sample initial poses among the obstacles of the scenario, (car, 3) [m, m, rad].

        Args:
            rng: Generator of the poses.
            n_cars: Number of cars; by default that of the scenario.

        Raises:
            EnvError: The scattered cars do not fit.
        """
        n = self.n_cars if n_cars is None else n_cars
        if self.layout == "ring":
            return ring_poses(n, self.ring, self.car, rng)
        if self.layout == "line":
            return line_poses(n, self.ring, rng)
        return self.scattered(Floor(self.room, self.car, boxes_of(self.obstacles)), n, rng)

    def scattered(self, floor: Floor, n: int, rng: np.random.Generator) -> F64:
        """Sample random poses on a floor, (car, 3) [m, m, rad].

        Raises:
            EnvError: The cars do not fit.
        """
        for _ in range(20):
            poses = floor.scatter(n, self.start_area, np.zeros((0, 2)), rng)
            if len(poses) == n:
                return poses
        raise EnvError(
            f"n_cars: {n} do not fit into scenario {self.name!r}, the last try placed {len(poses)}"
        )

    def with_gap(self, gap: Gap | None) -> Scenario:
        """Return a copy with another gap and its wall, or without a gap.

        Raises:
            EnvError: The gap is wider than the wall, too narrow for a car, or blocked.
        """
        old = () if self.gap is None else self.gap.wall(self.room)
        rest = tuple(o for o in self.obstacles if o not in old)
        new = () if gap is None else gap.wall(self.room)
        return replace(self, gap=gap, obstacles=rest + new)

    def at_level(self, value: int | str) -> Scenario:
        """Return a copy with the randomisation of a curriculum level.

        The number of cars is sampled from the numbers that both the level and the room allow.

        Args:
            value: 0 (none) to 4, or a name in `relpos_env.scenarios.levels.NAMES`.

        Raises:
            EnvError: There is no such level.
        """
        randomisation = level(value)
        if randomisation.n_cars is not None:
            low = max(randomisation.n_cars[0], self.n_cars_range[0])
            high = min(randomisation.n_cars[1], self.n_cars_range[1], most_that_start(self))
            randomisation = replace(randomisation, n_cars=(low, high) if low <= high else None)
        return replace(self, randomisation=randomisation)
