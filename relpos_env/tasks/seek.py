"""Task `seek`: find and stay with a transponder that only ranges."""

from __future__ import annotations

import numpy as np

from relpos_env.tasks.escort import Escort


class Seek(Escort):
    """Slots round a transponder that moves slowly, of which nothing but ranges is known.

    Car 0 carries it, without inertial sensors and magnetometer; while it is absent, the first
    present car takes its place.
    """

    def __init__(
        self,
        n_cars: int,
        n_envs: int,
        room: tuple[float, float],
        *,
        spacing: float | None = None,
        speed: float = 0.2,
    ) -> None:
        """Check the options; these and the errors are those of `Escort`."""
        super().__init__(n_cars, n_envs, room, spacing=spacing, speed=speed)
        self.has_samples = np.arange(n_cars) > 0
