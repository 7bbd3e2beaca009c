"""Excitation manoeuvre of cars without estimates or command: trackers need motion to converge."""

from __future__ import annotations

from math import pi

import numpy as np

from agents.controllers.base import Sight, length
from relpos_env.interface.actions import MAX_SPEED
from relpos_env.interface.observations.base import F32

SENT = 0.3
"""[m/s] Commands from this speed on need no excitation manoeuvre."""
SPEED = 0.6
"""[m/s] Speed of the excitation manoeuvre."""
ARC = pi / 4
"""[rad] Heading change per stroke, forwards and backwards; an even fraction of a full turn."""


def search(sight: Sight, actions: F32) -> F32:
    """Replace the actions of cars without estimates and command, in place, (..., 2).

    The cars alternate between forward and backward arcs in little space, always turning left; the
    heading selects the direction of travel. Cars without a known heading, or with observations of
    ranges, which arrive without excitation, keep their actions.
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
