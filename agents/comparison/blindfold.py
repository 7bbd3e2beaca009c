"""Masking of the other cars in observations."""

from __future__ import annotations

import numpy as np

from agents.policies.layout import Layout
from relpos_env.interface.observations.base import F32
from relpos_env.interface.observations.standard_fields import own_fields, target_fields

KEPT = {f.name for f in (*target_fields(1), *own_fields(1))}
"""Names of the fields of targets and of the car's own state."""


class Blindfold:
    """Masks the fields of the other cars in observations."""

    def __init__(self, layout: Layout) -> None:
        """Find the fields to be masked.

        Args:
            layout: Layout of the observations.
        """
        kept = np.concatenate([np.full(f.size, f.name in KEPT) for f in layout.fields])
        self._kept = np.tile(kept, layout.history)
        self._nobody = layout.alone()

    def __call__(self, observations: F32) -> F32:
        """Return the observations without estimates of other cars, (..., size)."""
        blind: F32 = np.where(self._kept, observations, self._nobody)
        return blind
