"""Whatever drives cars: controllers and policies alike."""

from __future__ import annotations

from typing import Protocol

from relpos_env.interface.observations.base import F32


class Driver(Protocol):
    """One law for every car; it keeps no state, what it remembers is in the observation."""

    def act(self, observations: F32) -> F32:
        """Actions of the cars that see the observations.

        Args:
            observations: (..., size), as the layout says that the driver was made for.

        Returns:
            (..., 2), speed and steering as shares of their largest values, -1 to 1.
        """
