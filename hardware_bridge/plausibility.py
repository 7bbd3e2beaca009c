"""Plausibility checks that refuse impossible values before they reach the tracker.

A damaged digit in a text format without a check sum yields another valid number. Physically
impossible values are refused here, such as a range far from the last ones of its pair or an
acceleration beyond the scale of the sensor. Possible but unlikely values are left to the tracker.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, fields
from typing import TypeAlias

from hardware_bridge.readings import ImuReading, PeerReading, StateReading, Vector

NS = 1_000_000_000
Place: TypeAlias = tuple[float, ...]
"""A distance, or a vector [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlausibilityParams:
    """Parameters of `Plausibility`."""

    nearest: float = 0.005
    """[m] Smallest accepted range; some devices report a missing range as 0.00."""
    farthest: float = 300.0
    """[m] Largest accepted range, beyond the reach of the radios."""
    closing_speed: float = 6.0
    """[m/s] Largest relative speed of two nodes: twice the top speed of a car."""
    jump: float = 1.0
    """[m] Largest sudden change of a range by noise and the onset of NLOS together. A smaller value
    refuses good ranges, a larger one leaves more outliers to the tracker."""
    agreeing: int = 3
    """[-] Number of consecutive outliers that agree with each other at which they are accepted, as
    after a node was carried away while silent."""
    agreeing_within: float = 5.0
    """[s] Longest interval between two consecutive outliers that agree."""
    gyr_scale: float = math.radians(2000.0)
    """[rad/s] Largest rate that the gyroscope can measure."""
    acc_scale: float = 16.0 * 9.80665
    """[m/s2] Largest acceleration that the accelerometer can measure."""
    mag_scale: float = 5000.0
    """[uT] Largest field that the magnetometer can measure."""
    rounding: float = 0.01
    """[-] Fraction by which rounding and calibration may exceed a scale."""
    norm: float = 0.05
    """[-] Largest deviation of the norm of a quaternion from 1."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not getattr(self, each.name) > 0:
                raise ValueError(f"{each.name}: a number above 0 expected")


@dataclass(slots=True)
class _Course:
    """Last accepted and refused range of one pair of nodes, or position of one node or pair."""

    place: Place
    t_ns: int
    agreeing: int = 0
    """Number of consecutive refused values that agree; `other` is the last of them."""
    other: Place = ()
    other_ns: int = 0


class Plausibility:
    """Filter that refuses implausible readings and counts them by reason.

    Invariants: values that change within the limits are never refused; after a real jump at most
    ``agreeing`` - 1 good ranges in a row are refused; a refused value does not affect later
    answers about ranges that agree with the accepted ones.
    """

    refused: Counter[str]
    """Refused readings by reason: ``not a number``, ``too near``, ``too far``, ``jump``, ``rate``,
    ``acceleration``, ``field``, ``attitude``."""

    def __init__(self, params: PlausibilityParams | None = None) -> None:
        self._params = PlausibilityParams() if params is None else params
        self._courses: dict[tuple[int | str, ...], _Course] = {}
        self.refused = Counter()

    def allows_range(self, i: int, j: int, distance: float, t_ns: int) -> bool:
        """Return whether a range is plausible; refused ranges are counted.

        Args:
            i: One node; the order of `i` and `j` has no meaning.
            j: The other node.
            distance: The range [m].
            t_ns: Time of the measurement, by the host's monotonic clock [ns].
        """
        reason = self._wrong_range((min(i, j), max(i, j)), distance, t_ns)
        return self._count(reason)

    def allows_place(self, who: tuple[int, ...], pos: Vector, t_ns: int) -> bool:
        """Return whether a position of a node, or of one relative to another, is plausible.

        Args:
            who: The node, or both nodes of a pair.
            pos: The position [m].
            t_ns: Time of the measurement, by the host's monotonic clock [ns].
        """
        if not all(math.isfinite(each) for each in pos):
            return self._count("not a number")
        return self._count(self._jump(("place", *who), pos, t_ns))

    def allows_imu(self, reading: ImuReading) -> bool:
        """Return whether a sample is within the scales of its sensors."""
        p = self._params
        return self._count(
            _wrong("rate", reading.gyr, p.gyr_scale * (1.0 + p.rounding))
            or _wrong("acceleration", reading.acc, p.acc_scale * (1.0 + p.rounding))
            or _wrong("field", reading.mag or (0.0, 0.0, 0.0), p.mag_scale * (1.0 + p.rounding))
        )

    def allows_state(self, reading: StateReading | PeerReading) -> bool:
        """Return whether the quaternion is normalised and the acceleration within the scale."""
        p = self._params
        length = math.hypot(*reading.q_wb)
        if not math.isfinite(length):
            return self._count("not a number")
        if abs(length - 1.0) > p.norm:
            return self._count("attitude")
        # Gravity has been subtracted, which may add to the sensor's scale.
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
        """Return whether a position may change by `change` [m] within `passed_ns` [ns]."""
        p = self._params
        return change <= p.jump + p.closing_speed * abs(passed_ns) / NS


def _wrong(reason: str, values: Vector, scale: float) -> str | None:
    if not all(math.isfinite(v) for v in values):
        return "not a number"
    return reason if any(abs(v) > scale for v in values) else None
