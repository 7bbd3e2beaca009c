"""Padding of observations for policies with more cars than the environment."""

from __future__ import annotations

import numpy as np

from agents.driver import Driver
from agents.policies.layout import Layout
from relpos_env.interface.observations.base import F32


class Padding:
    """Padding of observations, with missing cars as absent ones.

    Invariant: padded observations equal those of the same environment with the larger maximum
    number of cars.
    """

    def __init__(self, required: Layout, given: Layout) -> None:
        """Compute the indices.

        Args:
            required: Layout of the policy.
            given: Layout of the observations, equal except for at most as many cars.
        """
        where = required.padding_from(given)
        self._size = required.size
        self._places = np.flatnonzero(where >= 0)  # sorted below by the order in `given`
        self._places = self._places[np.argsort(where[self._places])]
        absent = np.where(where < 0, required.alone(), np.float32(0.0))
        # All zero in most modes, which is faster.
        self._absent = absent.reshape(required.history, -1) if absent.any() else None

    def __call__(self, observations: F32) -> F32:
        """Return the padded observations, (..., required size).

        Args:
            observations: Observations, (..., given size). Zeros of absent cars stay zeros.
        """
        lead = observations.shape[:-1]
        padded: F32 = np.zeros((*lead, self._size), dtype=np.float32)
        padded[..., self._places] = observations
        if self._absent is not None:
            frames = padded.reshape(*lead, *self._absent.shape)
            frames += frames.any(axis=-1, keepdims=True) * self._absent
        return padded


class PaddedDriver:
    """Driver for more cars than the environment has."""

    def __init__(self, driver: Driver, required: Layout, given: Layout) -> None:
        """Combine the driver with the padding.

        Args:
            driver: Driver for observations of `required`.
            required: Layout of the driver.
            given: Layout of the observations; see `Padding`.
        """
        self._driver, self._given = driver, given.size
        self._pad = Padding(required, given)

    def act(self, observations: F32) -> F32:
        """Return the actions, (..., 2); see `Driver`.

        Args:
            observations: Observations of the smaller layout, (..., size).

        Raises:
            ValueError: The observations have another size.
        """
        observations = np.asarray(observations, dtype=np.float32)
        if observations.shape[-1:] != (self._given,):
            raise ValueError(
                f"observations: expected (..., {self._given}), got {observations.shape}"
            )
        return self._driver.act(self._pad(observations))
