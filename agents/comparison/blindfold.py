"""Observations without the others: what a car sees that knows no other."""

from __future__ import annotations

import numpy as np

from agents.policies.layout import Layout
from relpos_env.interface.observations.base import F32
from relpos_env.interface.observations.standard_fields import own_fields, wish_fields

KEPT = {f.name for f in (*wish_fields(1), *own_fields(1))}
"""What is asked of a car and what it knows of itself."""


class Blindfold:
    """Takes from observations what they tell of the others."""

    def __init__(self, layout: Layout) -> None:
        """Find the places.

        Args:
            layout: Of the observations.
        """
        kept = np.concatenate([np.full(f.size, f.name in KEPT) for f in layout.fields])
        self._kept = np.tile(kept, layout.history)
        self._nobody = layout.alone()

    def __call__(self, observations: F32) -> F32:
        """The same, but no other car is known, (..., size)."""
        blind: F32 = np.where(self._kept, observations, self._nobody)
        return blind
