"""How fast cars may go towards what they must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import Plane
from tracking.arrays import F64
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest velocity towards each of several things, each (..., thing)."""

    __repr__ = short_repr

    toward: Plane
    """Direction of the thing, of length 1."""
    closing: F64
    """[m/s] Own velocity in that direction at most; infinite where there is nothing."""


def joined(one: Bounds, other: Bounds) -> Bounds:
    """The bounds of both."""
    parts = zip((*one.toward, one.closing), (*other.toward, other.closing), strict=True)
    x, y, closing = (np.concatenate(pair, axis=-1) for pair in parts)
    return Bounds((x, y), closing)
