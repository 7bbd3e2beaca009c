"""Observations of few cars as a policy for more cars wants them."""

from __future__ import annotations

import numpy as np

from agents.driver import Driver
from agents.policies.layout import Layout
from relpos_env.interface.observations.base import F32


class Padding:
    """Writes observations as if the cars that are missing were absent.

    Law: an environment with more slots than cars gives what this makes of the same environment
    with as many slots as cars.
    """

    def __init__(self, wanted: Layout, given: Layout) -> None:
        """Find the places.

        Args:
            wanted: What the policy sees.
            given: What the cars see; the same but for the number of cars, which is not larger.
        """
        where = wanted.padding_from(given)
        self._size = wanted.size
        self._places = np.flatnonzero(where >= 0)  # in the order in which they are given
        self._places = self._places[np.argsort(where[self._places])]
        absent = np.where(where < 0, wanted.alone(), np.float32(0.0))
        # Of most modes nothing but zeros, and that is quicker.
        self._absent = absent.reshape(wanted.history, -1) if absent.any() else None

    def __call__(self, observations: F32) -> F32:
        """The observations padded, (..., wanted size).

        Args:
            observations: (..., given size). Those of absent cars, which are zeros, stay zeros.
        """
        lead = observations.shape[:-1]
        padded: F32 = np.zeros((*lead, self._size), dtype=np.float32)
        padded[..., self._places] = observations
        if self._absent is not None:
            frames = padded.reshape(*lead, *self._absent.shape)
            frames += frames.any(axis=-1, keepdims=True) * self._absent
        return padded


class PaddedDriver:
    """A driver for more cars than there are."""

    def __init__(self, driver: Driver, wanted: Layout, given: Layout) -> None:
        """Put the padding in front.

        Args:
            driver: Drives cars that see `wanted`.
            wanted: Its layout.
            given: What the cars see; see `Padding`.
        """
        self._driver, self._given = driver, given.size
        self._pad = Padding(wanted, given)

    def act(self, observations: F32) -> F32:
        """Actions, (..., 2); see `Driver`.

        Args:
            observations: (..., size) of the smaller layout.

        Raises:
            ValueError: They have another size.
        """
        observations = np.asarray(observations, dtype=np.float32)
        if observations.shape[-1:] != (self._given,):
            raise ValueError(
                f"observations: expected (..., {self._given}), got {observations.shape}"
            )
        return self._driver.act(self._pad(observations))
