"""Input and output of the gate's rules."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hardware_bridge.safety.picture import Picture
from hardware_bridge.safety.recent import Recent
from hardware_bridge.safety.telemetry import TelemetryState
from tracking.arrays import F64, Bool

FREE = np.inf


class Moment(NamedTuple):
    """Input of a rule."""

    picture: Picture
    now: F64
    """Current time, (env) [s]."""
    word: F64
    """Time of the deciding process's last heartbeat, (env) [s]."""
    t_last_message: F64
    """Time of the last message of each car's node, (env, car) [s]."""
    linked: Bool
    """True if the car's own port is open, (env, car)."""
    armed: Bool
    """True for armed cars, which the gate limits by its rules, (env, car)."""
    recent: Recent
    """Bounds of the cars' motion given the latest commands."""
    telemetry: TelemetryState
    """Telemetry of the cars' controllers."""
    was_slow: Bool
    """True if this rule's last verdict capped or stopped the car, (env, car): for hysteresis."""


class Verdict(NamedTuple):
    """Limits that a rule sets for each car."""

    forward: F64
    """Highest speed forwards, (env, car) [m/s]."""
    backward: F64
    """Highest speed backwards, (env, car) [m/s]."""
    hold: Bool
    """True to disarm the car, (env, car); it moves again only after arming."""
    left: F64 | float = FREE
    """Largest steering angle to the left, (env, car) [rad]."""
    right: F64 | float = FREE
    """Largest steering angle to the right, (env, car) [rad]."""
