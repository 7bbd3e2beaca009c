"""Interface of controllers and policies."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from relpos_env.interface.observations.base import F32


@runtime_checkable
class Driver(Protocol):
    """A stateless control law for every car; any memory is part of the observation."""

    def act(self, observations: F32) -> F32:
        """Return the actions for observations.

        Args:
            observations: Observations in the layout of the driver, (..., size).

        Returns:
            Speed and steering as shares of their largest values, -1 to 1, (..., 2).
        """
