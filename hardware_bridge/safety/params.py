"""Limits of the safety gate; a user can set each of them in ``[safety]``."""

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
"""Permitted interval of each limit: values outside disable a rule or keep every car at rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fence:
    """A polygon that cars must not leave, fixed to a static node."""

    node: int
    """Id of the static node; corners are relative to it."""
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
    """Limits of the gate. A disarmed car stops and must be armed again."""

    max_speed: float = 1.5
    """[m/s] Speed limit of every car."""
    max_steering: float = 0.42
    """[rad] Limit of the steering angle."""
    max_accel: float = 3.0
    """[m/s2] Limit on the rise of commanded speed; it may fall at once."""
    max_steering_rate: float = 6.0
    """[rad/s] Limit on the rate of the steering command; servos turn 3 to 6 rad/s."""
    slow: float = 0.3
    """[m/s] Speed cap of rules that slow cars down."""
    silence: float = 0.06
    """[s] Longest time without a heartbeat of the deciding process; then cars are disarmed. With a
    tick and a write this leaves 20 ms of the 100 ms within which neutral is on the wire."""
    stale_slow: float = 0.15
    """[s] Age of a node's last message, or of the estimates, above which its car is capped to
    `slow`."""
    stale_stop: float = 0.3
    """[s] Age of a node's last message, or of the estimates, above which its car is disarmed."""
    sigma_slow: float = 0.5
    """[m] Standard deviation of another car's position above which a car is capped to `slow`."""
    sigma_stop: float = 1.0
    """[m] Standard deviation of another car's position above which a car is disarmed."""
    hysteresis: float = 0.8
    """[-] Fraction of `sigma_slow` below which a capped car is no longer capped."""
    health: float = 0.5
    """[s] Time without a disarming rule before a car can be armed."""
    braking: float = 2.0
    """[m/s2] Deceleration that every car reaches at least; 1:10 cars on a clean floor reach 2.5."""
    hardest: float = 5.0
    """[m/s2] Deceleration that no car exceeds: a car that drives away takes time to stop."""
    reaction: float = 0.25
    """[s] Delay from the time of the estimates to the onset of braking, without the age of the
    decision: tick, wire, motor and its controller, and lag of the estimates."""
    turning_radius: float = 0.65
    """[m] Radius of the cars' tightest turn: wheelbase over the tangent of `max_steering`."""
    turning_room: float = 0.4
    """[m] Clearance to an obstacle abeam below which steering towards it is limited to a fraction
    of `max_steering`."""
    deadman: float = 0.2
    """[s] A car that receives nothing stops by itself after this time; the gate assumes that a car
    without its port drives on for as long."""
    separation: float = 0.5
    """[m] Least distance between the centres of two cars; a 1:10 car is 0.42 m long."""
    confidence: float = 2.5
    """[-] Largest assumed position error in standard deviations."""
    range_error: float = 0.2
    """[m] Largest assumed excess of a range used without a position, as without line of sight."""
    range_limit: float = 1.0
    """[s] Age above which a range to a car of unknown position is not used; the car stops."""
    runaway_speed: float = 0.5
    """[m/s] Tolerated excess of a car's reported speed over the highest one that its commands
    explain: errors of odometry, and spinning wheels."""
    runaway_time: float = 0.3
    """[s] Duration of an excess above `runaway_speed` after which a car is disarmed."""
    idle_time: float = 3.0
    """[s] Time at rest despite a command to drive after which a car is disarmed."""
    answer_time: float = 0.5
    """[s] Time without an acknowledgement or a reported speed after which a car is disarmed; for
    controllers that send them."""
    cell_slow: float = 3.4
    """[V] Cell voltage, mean over seconds, below which a car is capped to `slow`. Checked for cars
    with `cells`."""
    cell_stop: float = 3.2
    """[V] Cell voltage, mean over seconds, below which a car is disarmed."""
    others_drive: bool = False
    """True if other cars may be driven by gates of their own, on other computers: next to these a
    car uses at most half of the clearance."""
    fence: Fence | None = None
    """Fence that the cars must not leave; None without a fence."""

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name in ("fence", "others_drive"):
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
