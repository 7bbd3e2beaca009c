"""Bounds of the velocity towards cars and obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.controllers.base import Plane
from tracking.arrays import F64
from tracking.params.short_repr import short_repr


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest velocity towards each of several objects, each (..., object)."""

    __repr__ = short_repr

    toward: Plane
    """Unit vector towards the object."""
    closing: F64
    """[m/s] Maximum own velocity in the direction `toward`; infinite without an object."""


def joined(one: Bounds, other: Bounds) -> Bounds:
    """Return the bounds of both."""
    parts = zip((*one.toward, one.closing), (*other.toward, other.closing), strict=True)
    x, y, closing = (np.concatenate(pair, axis=-1) for pair in parts)
    return Bounds((x, y), closing)
