"""Trackers find each other by motion: without a command, a car that knows no other drives about."""

from __future__ import annotations

from math import pi

import numpy as np

from agents.controllers.base import Sight, length
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.interface.observations.base import F32

SENT = 0.3
"""[m/s] Who is sent faster than this moves enough."""
SPEED = 0.6
"""[m/s] Of the search."""
ARC = pi / 4
"""[rad] Turned by so much, a searching car changes its gear; an even part of a full turn."""


def search(sight: Sight, actions: F32) -> F32:
    """Actions with those replaced of cars that search, in place, (..., 2).

    They turn in little room, always the same way round, and know by their heading which gear is
    due. A car that does not know its heading follows the command, and so does one that sees ranges:
    it would hear of others without a search.
    """
    if sight.age is not None:
        return actions
    lost = ~sight.ok.any(axis=-1) & (length(sight.command) < SENT)
    if not lost.any():
        return actions
    cosine, sine = sight.heading
    lost &= (cosine != 0.0) | (sine != 0.0)
    angle = np.arctan2(np.ascontiguousarray(sine), np.ascontiguousarray(cosine))
    gear = np.where(np.floor(angle / ARC) % 2 == 0, 1.0, -1.0)
    actions[..., 0] = np.where(lost, gear * (SPEED / MAX_SPEED), actions[..., 0])
    actions[..., 1] = np.where(lost, gear, actions[..., 1])
    return actions
