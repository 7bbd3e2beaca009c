"""What the safety gate allows; every limit is a number that a user can set in ``[safety]``."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from hardware_bridge.errors import BridgeError
from hardware_bridge.safety.geometry.polygon import area

LIMITS = {
    "max_speed": (0.05, 20.0),
    "max_steering": (0.01, 1.5),
    "max_accel": (0.1, 50.0),
    "max_steering_rate": (0.1, 100.0),
    "slow": (0.01, 5.0),
    "silence": (0.02, 0.1),
    "stale_slow": (0.02, 1.0),
    "stale_stop": (0.03, 2.0),
    "sigma_slow": (0.01, 2.0),
    "sigma_stop": (0.02, 5.0),
    "hysteresis": (0.1, 1.0),
    "health": (0.1, 60.0),
    "braking": (0.1, 20.0),
    "hardest": (0.1, 50.0),
    "reaction": (0.01, 2.0),
    "turning_radius": (0.05, 20.0),
    "turning_room": (0.01, 5.0),
    "deadman": (0.05, 2.0),
    "separation": (0.05, 20.0),
    "confidence": (0.5, 10.0),
    "range_error": (0.01, 5.0),
    "range_limit": (0.1, 10.0),
    "runaway_speed": (0.05, 5.0),
    "runaway_time": (0.02, 2.0),
    "idle_time": (0.2, 60.0),
    "answer_time": (0.1, 5.0),
    "cell_slow": (0.5, 5.0),
    "cell_stop": (0.4, 5.0),
}
"""Least and most of each limit: beyond, a rule would be switched off, or no car would ever move."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fence:
    """A polygon that cars must not leave, fixed to a static node."""

    node: int
    """Id of the static node that its corners are relative to."""
    corners: tuple[tuple[float, float], ...]
    """[m] World frame (x east, y magnetic north), in order, at least three."""

    def __post_init__(self) -> None:
        if len(self.corners) < 3:
            raise BridgeError(f"corners: expected at least 3, got {len(self.corners)}")
        if not all(max(abs(x), abs(y)) <= 1e4 for x, y in self.corners):
            raise BridgeError("corners: expected metres within 10 km")
        if abs(area(np.array(self.corners))) < 0.1:
            raise BridgeError("corners: expected a polygon with an area")


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyParams:
    """Limits of the gate. A car that was stopped for good must be armed again."""

    max_speed: float = 1.5
    """[m/s] Of any car."""
    max_steering: float = 0.42
    """[rad]"""
    max_accel: float = 3.0
    """[m/s2] Commanded speed rises no faster; it may fall at once."""
    max_steering_rate: float = 6.0
    """[rad/s] Of the command; servos turn 3 to 6 rad/s."""
    slow: float = 0.3
    """[m/s] Where a rule says slow."""
    silence: float = 0.06
    """[s] Without a word from the process that decides; then cars are stopped for good. With a
    tick and a write this leaves 20 ms of the 100 within which neutral is on the wire."""
    stale_slow: float = 0.15
    """[s] Since a car's node was last heard."""
    stale_stop: float = 0.3
    """[s] Since a car's node was last heard; stopped for good."""
    sigma_slow: float = 0.5
    """[m] Largest standard deviation of where another is."""
    sigma_stop: float = 1.0
    """[m] Largest standard deviation of where another is; stopped for good."""
    hysteresis: float = 0.8
    """[-] What went over a limit counts as below it again at this share of it."""
    health: float = 0.5
    """[s] Everything must have been well for so long before a car can be armed."""
    braking: float = 2.0
    """[m/s2] What cars surely brake with. 1:10 cars on a clean floor reach 2.5."""
    hardest: float = 5.0
    """[m/s2] What cars surely do not brake harder with: one that drives away does not stand at
    once."""
    reaction: float = 0.25
    """[s] From a moment that the estimates tell of to brakes that bite, the age of the decision
    not counted: tick, wire, motor and its controller, and what estimates lag behind."""
    turning_radius: float = 0.65
    """[m] Of the cars' tightest turn: wheelbase over the tangent of `max_steering`."""
    turning_room: float = 0.4
    """[m] With less room to something abeam, cars may turn towards it by a share of
    `max_steering` only."""
    deadman: float = 0.2
    """[s] A car that hears nothing stops by itself after so long; counted for the others where a
    car's port is lost."""
    separation: float = 0.5
    """[m] Between the middles of two cars, never less; a 1:10 car is 0.42 m long."""
    confidence: float = 2.5
    """[-] Standard deviations that positions are believed to be off at most."""
    range_error: float = 0.2
    """[m] By which a range alone is believed to be too long at most: no line of sight."""
    range_limit: float = 1.0
    """[s] Where positions are not known, a range as old as this says nothing any more; the car
    stands."""
    runaway_speed: float = 0.5
    """[m/s] By which a car may be faster, by its own controller, than it can be for what it was
    sent: errors of odometry, and wheels that spin."""
    runaway_time: float = 0.3
    """[s] For so long; then it is stopped for good."""
    idle_time: float = 3.0
    """[s] A car whose wheels stand for so long although it is asked to drive is stopped for
    good."""
    answer_time: float = 0.5
    """[s] A car whose controller answers commands, and has answered none for so long, is stopped
    for good."""
    cell_slow: float = 3.4
    """[V] Of a cell of the battery, mean over seconds; below, `slow`. Looked at where a car has
    `cells`."""
    cell_stop: float = 3.2
    """[V] Below, stopped for good."""
    fence: Fence | None = None
    """None where there is none."""

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name == "fence":
                continue
            least, most = LIMITS[f.name]
            if not least <= value <= most:
                raise BridgeError(f"{f.name}: expected {least:g} to {most:g}, got {value!r}")
        for low, high in (
            ("stale_slow", "stale_stop"),
            ("sigma_slow", "sigma_stop"),
            ("cell_stop", "cell_slow"),
        ):
            if getattr(self, low) >= getattr(self, high):
                limit = getattr(self, high)
                raise BridgeError(f"{low}: expected below {high} = {limit:g}")
        if self.hardest < self.braking:
            raise BridgeError(f"hardest: expected at least braking = {self.braking:g}")
        if self.slow > self.max_speed:
            raise BridgeError(f"slow: expected at most max_speed = {self.max_speed:g}")
