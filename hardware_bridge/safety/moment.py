"""What a rule of the gate sees, and what it says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.recent import Recent
from hardware_bridge.safety.telemetry import Told
from tracking.arrays import F64, Bool

FREE = np.inf


class Moment(NamedTuple):
    """All that rules see."""

    picture: Picture
    now: F64
    """(env) [s]"""
    word: F64
    """When the deciding process last gave a sign of life, (env) [s]."""
    heard: F64
    """When each car's node was last heard, (env, car) [s]."""
    linked: Bool
    """Whether the car's own port is open, (env, car)."""
    armed: Bool
    """Whether the gate holds the car to its rules, (env, car)."""
    recent: Recent
    """What the cars were told lately."""
    told: Told
    """What the cars' own controllers say."""
    was_slow: Bool
    """Whether the last verdict of this rule capped or stopped, (env, car): for hysteresis."""


class Verdict(NamedTuple):
    """Limits that a rule sets for each car."""

    forward: F64
    """Highest speed forwards, (env, car) [m/s]."""
    backward: F64
    """Highest speed backwards, (env, car) [m/s]."""
    hold: Bool
    """Stop for good: only arming again lets it move, (env, car)."""
    left: F64 | float = FREE
    """Largest steering angle to the left, (env, car) [rad]."""
    right: F64 | float = FREE
    """Largest steering angle to the right, (env, car) [rad]."""
