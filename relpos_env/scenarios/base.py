"""What a scenario is: everything about a world but its seed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.vehicle import CarParams
from relpos_env.world import Obstacle
from tracking.arrays import F64


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """A room with obstacles, cars and sensors."""

    name: str
    room: tuple[float, float]
    """[m] Along x and along y; the origin is the centre."""
    obstacles: tuple[Obstacle, ...] = ()
    n_cars: int = 3
    ring: tuple[float, float]
    """[m] Half axes of the loop on which the cars start and drive round the centre."""
    in_line: bool = False
    """The cars start on one straight line beside the centre, in place of on the loop."""
    car: CarParams = field(default_factory=CarParams)
    imu: ImuSimParams = field(default_factory=ImuSimParams)
    mag: MagSimParams = field(default_factory=MagSimParams)
    odometer: OdometerSimParams = field(default_factory=OdometerSimParams)
    radio: RadioSimParams = field(default_factory=RadioSimParams)

    def __post_init__(self) -> None:
        if self.n_cars < 2:
            raise EnvError(f"cars: expected at least 2, got {self.n_cars}")
        room_for = int(np.pi * sum(self.ring) / (1.5 * self.car.length))
        if self.n_cars > room_for:
            raise EnvError(
                f"cars: {self.n_cars} do not fit on the loop of scenario {self.name!r}, "
                f"expected at most {room_for}"
            )

    def start(self, rng: np.random.Generator) -> F64:
        """Starting poses, evenly on the loop with some disorder, (car, 3) [m, m, rad].

        On a line (`in_line`) the spacing is even and only the headings are in disorder.
        """
        n = self.n_cars
        if self.in_line:
            a, b = self.ring
            y = (np.arange(n) - 0.5 * (n - 1)) * 2.0 * b / n
            heading = 0.5 * np.pi + rng.uniform(-0.1, 0.1, n)
            return np.stack([np.full(n, a), y, heading], axis=1)
        spacing = 2.0 * np.pi / n
        phase = rng.uniform(0.0, 2.0 * np.pi) + spacing * np.arange(n)
        phase += rng.uniform(-0.1, 0.1, n) * spacing
        a, b = self.ring
        heading = np.arctan2(b * np.cos(phase), -a * np.sin(phase)) + rng.uniform(-0.1, 0.1, n)
        return np.stack([a * np.cos(phase), b * np.sin(phase), heading], axis=1)
