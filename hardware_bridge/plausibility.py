"""What a damaged text lets through and cannot be: refused before it reaches the tracker.

Text formats without a check sum take a damaged digit for another number. A range far from the last
ones of its pair, an acceleration beyond the scale of the sensor: such numbers are refused here, by
what is possible at all. What is possible but unlikely is the tracker's to judge, which knows more.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, fields
from typing import TypeAlias

from hardware_bridge.readings import ImuReading, StateReading, Vector

NS = 1_000_000_000
Place: TypeAlias = tuple[float, ...]
"""A distance, or a vector [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlausibilityParams:
    """Of `Plausibility`."""

    nearest: float = 0.005
    """[m] Ranges below are no ranges: 0.00 is how some devices say that they have none."""
    farthest: float = 300.0
    """[m] More than the radios reach."""
    closing_speed: float = 6.0
    """[m/s] Of two nodes towards or away from each other: twice the top speed of a car."""
    jump: float = 1.0
    """[m] What noise and a wall that comes between add at once. Smaller refuses good ranges, larger
    leaves more to the tracker."""
    agreeing: int = 3
    """[-] Refused ranges in a row that agree with each other are believed: the node was carried
    away while it was silent."""
    agreeing_within: float = 5.0
    """[s] From each to the next."""
    gyr_scale: float = math.radians(2000.0)
    """[rad/s] Largest rate that the sensor can say."""
    acc_scale: float = 16.0 * 9.80665
    """[m/s2] Largest acceleration."""
    mag_scale: float = 5000.0
    """[uT] Largest field."""
    rounding: float = 0.01
    """[-] Scales are exceeded by so much through rounding and calibration."""
    norm: float = 0.05
    """[-] How far the length of a quaternion may be from 1."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not getattr(self, each.name) > 0:
                raise ValueError(f"{each.name}: a number above 0 expected")


@dataclass(slots=True)
class _Course:
    """Ranges of one pair of nodes, or places of one node or pair."""

    place: Place
    t_ns: int
    agreeing: int = 0
    """Refused ones in a row that agree; the last of them follows."""
    other: Place = ()
    other_ns: int = 0


class Plausibility:
    """Refuses readings that cannot be, and counts them by reason.

    Laws: what moves within the limits is never refused; after a real jump no more than
    ``agreeing`` - 1 good ranges in a row are; what is refused changes no later answer about
    ranges that agree with the ones accepted.
    """

    refused: Counter[str]
    """By reason: ``not a number``, ``too near``, ``too far``, ``jump``, ``rate``,
    ``acceleration``, ``field``, ``attitude``."""

    def __init__(self, params: PlausibilityParams | None = None) -> None:
        self._params = PlausibilityParams() if params is None else params
        self._courses: dict[tuple[int | str, ...], _Course] = {}
        self.refused = Counter()

    def allows_range(self, i: int, j: int, distance: float, t_ns: int) -> bool:
        """Whether a range can be.

        Args:
            i: One node; the order of the two says nothing.
            j: The other.
            distance: [m]
            t_ns: When it was measured, by the host's monotonic clock [ns].
        """
        reason = self._wrong_range((min(i, j), max(i, j)), distance, t_ns)
        return self._count(reason)

    def allows_place(self, who: tuple[int, ...], pos: Vector, t_ns: int) -> bool:
        """Whether a node, or one relative to another, can be there.

        Args:
            who: The node, or both.
            pos: [m]
            t_ns: As in `allows_range`.
        """
        if not all(math.isfinite(each) for each in pos):
            return self._count("not a number")
        return self._count(self._jump(("place", *who), pos, t_ns))

    def allows_imu(self, reading: ImuReading) -> bool:
        """Whether a sample is within the scales of its sensors."""
        p = self._params
        return self._count(
            _wrong("rate", reading.gyr, p.gyr_scale * (1.0 + p.rounding))
            or _wrong("acceleration", reading.acc, p.acc_scale * (1.0 + p.rounding))
            or _wrong("field", reading.mag or (0.0, 0.0, 0.0), p.mag_scale * (1.0 + p.rounding))
        )

    def allows_state(self, reading: StateReading) -> bool:
        """Whether an orientation is one, and the acceleration within the scale."""
        p = self._params
        length = math.hypot(*reading.q_wb)
        if not math.isfinite(length):
            return self._count("not a number")
        if abs(length - 1.0) > p.norm:
            return self._count("attitude")
        # Gravity was taken off: it may add to the sensor's scale.
        return self._count(
            _wrong("acceleration", reading.accel_w, (p.acc_scale + 10.0) * (1.0 + p.rounding))
        )

    def _count(self, reason: str | None) -> bool:
        if reason is not None:
            self.refused[reason] += 1
        return reason is None

    def _wrong_range(self, key: tuple[int, int], distance: float, t_ns: int) -> str | None:
        p = self._params
        if not math.isfinite(distance):
            return "not a number"
        if distance < p.nearest:
            return "too near"
        if distance > p.farthest:
            return "too far"
        return self._jump(key, (distance,), t_ns)

    def _jump(self, key: tuple[int | str, ...], place: Place, t_ns: int) -> str | None:
        p = self._params
        course = self._courses.get(key)
        if course is None:
            self._courses[key] = _Course(place, t_ns)
            return None
        if not self._can_follow(math.dist(place, course.place), t_ns - course.t_ns):
            recent = abs(t_ns - course.other_ns) <= p.agreeing_within * NS
            agrees = course.agreeing > 0 and recent
            if agrees:
                change = math.dist(place, course.other)
                agrees = self._can_follow(change, t_ns - course.other_ns)
            course.agreeing = course.agreeing + 1 if agrees else 1
            course.other, course.other_ns = place, t_ns
            if course.agreeing < p.agreeing:
                return "jump"
        course.place, course.t_ns, course.agreeing = place, t_ns, 0
        return None

    def _can_follow(self, change: float, passed_ns: int) -> bool:
        """Whether a place may change by this [m] within this time [ns]."""
        p = self._params
        return change <= p.jump + p.closing_speed * abs(passed_ns) / NS


def _wrong(reason: str, values: Vector, scale: float) -> str | None:
    if not all(math.isfinite(v) for v in values):
        return "not a number"
    return reason if any(abs(v) > scale for v in values) else None
