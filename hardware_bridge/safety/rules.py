"""The rules of the gate, a table: each caps speeds, and may disarm a car.

A rule evaluates one snapshot, arrays over (env, car), and has no memory. Comparisons are written
such that NaN and future times count as faults.
`docs/explanation/safety.md` describes the rules and derives the distances.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hardware_bridge.safety.geometry.approach import REAR, age_of, ahead_of, approach, bearing
from hardware_bridge.safety.geometry.braking import stopping_speed, stopping_way
from hardware_bridge.safety.geometry.polygon import outwards, to_edges
from hardware_bridge.safety.geometry.turning import gain
from hardware_bridge.safety.moment import FREE, Moment, Verdict
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from tracking.arrays import F64, Bool
from tracking.estimate import Status

AHEAD = 0.05
"""[s] Times that are further ahead of the clock are invalid."""
DIRECTION = 1.0
"""[-] Assumed position error for the direction of another car that is too near, in standard
deviations; with a larger value cars next to each other could not part."""


RECOVERED = 0.1
"""[V] Margin above `cell_slow` from which a battery counts as charged again."""
LONG_AGO = 60.0
"""[s] Older ranges count as missing."""


class Rule(NamedTuple):
    """A rule of the table."""

    name: str
    check: Callable[[Moment, SafetyParams], Verdict]
    meaning: str
    """Reason reported to the user."""
    effect: str
    """Effect of the rule, for `docs/explanation/safety.md`."""


def silence(m: Moment, p: SafetyParams) -> Verdict:
    """The deciding process hangs, was stopped or has ended."""
    quiet: Bool = _never(m) | ~_within(m.now - m.word, p.silence)[:, None]
    return _held(quiet)


def link(m: Moment, p: SafetyParams) -> Verdict:
    """The car's own port is lost."""
    return _held(~m.linked)


def fault(m: Moment, p: SafetyParams) -> Verdict:
    """The car's controller reports a fault."""
    return _held(m.telemetry.fault)


def runaway(m: Moment, p: SafetyParams) -> Verdict:
    """The car's controller reports a speed that no command explains."""
    return _held(m.telemetry.over_for >= p.runaway_time)


def deaf(m: Moment, p: SafetyParams) -> Verdict:
    """The car acknowledges no commands, reports no speed, or is at rest despite commands."""
    return _held((m.telemetry.deaf_for >= p.answer_time) | (m.telemetry.idle_for >= p.idle_time))


def battery(m: Moment, p: SafetyParams) -> Verdict:
    """The car's battery is nearly empty."""
    limit = np.where(m.was_slow, p.cell_slow + RECOVERED, p.cell_slow)
    low, empty = m.telemetry.cell < limit, m.telemetry.cell < p.cell_stop
    return _capped(np.where(empty, 0.0, np.where(low, p.slow, FREE)), empty)


def absent(m: Moment, p: SafetyParams) -> Verdict:
    """The car is not part of the group; others would not avoid it."""
    return _held(m.picture.present != 1.0)


def stale(m: Moment, p: SafetyParams) -> Verdict:
    """The last message of the car's node or the latest estimates are too old."""
    times = (m.now[:, None] - m.t_last_message, (m.now - m.picture.t)[:, None])
    old = ~(_within(times[0], p.stale_stop) & _within(times[1], p.stale_stop))
    older = ~(_within(times[0], p.stale_slow) & _within(times[1], p.stale_slow))
    return _capped(np.where(old, 0.0, np.where(older, p.slow, FREE)), old)


def covariance(m: Moment, p: SafetyParams) -> Verdict:
    """A covariance matrix is invalid: not finite, not symmetric or not positive definite."""
    q = m.picture
    bad: Bool = np.any(_judged(q) & ((q.sound != 1.0) | ~(q.sigma >= 0.0)), axis=-1)
    return _held(bad)


def sigma(m: Moment, p: SafetyParams) -> Verdict:
    """The position of another car is too uncertain."""
    worst = np.where(_judged(m.picture), m.picture.sigma, 0.0).max(axis=-1)
    over = ~(worst <= p.sigma_slow * np.where(m.was_slow, p.hysteresis, 1.0))
    far = ~(worst <= p.sigma_stop)
    return _capped(np.where(far, 0.0, np.where(over, p.slow, FREE)), far)


def unknown(m: Moment, p: SafetyParams) -> Verdict:
    """The position of another car is not known yet, or its ranges contradict each other."""
    q = m.picture
    unsure = _others(q) & ~_judged(q)
    age = m.now[:, None, None] - q.ranged
    ranged = _within(age, LONG_AGO) & np.isfinite(q.distance)
    known = ranged & (age <= p.range_limit)
    # An obstruction is temporary: a car that is stopped, not disarmed, continues once it is past.
    hold: Bool = np.any(unsure & ~ranged, axis=-1)
    halt: Bool = np.any(unsure & ~known, axis=-1)
    # DOUBTFUL lasts for seconds and ends only through motion; capped to `slow`, a formation would
    # break up. Pairs that are not known yet are capped.
    slow: Bool = np.any(unsure & (q.status != Status.DOUBTFUL), axis=-1)
    # Only the distance is known: both cars may be approaching, so each uses half of it.
    way = 0.5 * (q.distance - p.range_error - p.separation)
    speed = stopping_speed(way, p.reaction + np.where(known, np.maximum(age, 0.0), 0.0), p.braking)
    cap = np.where(unsure, speed, FREE).min(axis=-1)
    cap = np.where(slow, np.minimum(cap, p.slow), cap)
    return _capped(np.where(halt, 0.0, cap), hold)


def lost_heading(m: Moment, p: SafetyParams) -> Verdict:
    """The heading of the car is not known."""
    sure = (m.picture.oriented == 1.0) & np.isfinite(m.picture.heading)
    return _capped(np.where(sure, FREE, 0.0), _never(m))


def separation(m: Moment, p: SafetyParams) -> Verdict:
    """Another car is nearer than both cars need to stop.

    A car may use half of the clearance, or all that the other cannot use at its speed if that is
    larger; next to a node that no gate limits, only the latter. Such a node (a person, a pushed
    car) is assumed to keep its estimated speed in any direction. If it may have a gate of its own
    (`SafetyParams.others_drive`), a car also leaves it its half.
    """
    q, recent = m.picture, m.recent
    ahead = ahead_of(q)
    d = np.maximum(np.hypot(q.pos[..., 0], q.pos[..., 1]), 1e-9)
    towards = q.pos / d[..., None]
    room = d - p.separation - p.confidence * q.sigma
    time = p.reaction + age_of(m) + np.where(m.linked, 0.0, m.telemetry.watchdog)
    angle, _ = bearing(ahead[:, None, :], -towards)
    sure = (q.oriented == 1.0)[:, None, :]
    held = m.armed[:, None, :]
    own = np.nan_to_num(ahead) * q.speed[..., None]
    seen = np.hypot(*np.moveaxis(q.vel + own[:, :, None, :], -1, 0))
    free = np.where(held, 0.0, np.maximum(seen, np.abs(q.speed)[:, None, :]))
    used = stopping_way(free, time[:, None, :], p.braking)
    swing = np.arctan(REAR / p.turning_radius)
    for sign, bound in ((1.0, recent.forward), (-1.0, recent.backward)):
        way = stopping_way(np.maximum(sign * q.speed, bound), time, p.braking)[:, None, :]
        off = angle if sign > 0.0 else np.pi - angle
        turned = np.where(sure, np.maximum(off - swing, 0.0), 0.0)
        used = np.maximum(used, gain(way, turned, p.turning_radius))
        gone = np.minimum(sign * q.speed, sign * recent.speed)[:, None, :] * -np.cos(off)
        room = room + np.where(sure & held, np.maximum(gone, 0.0) ** 2, 0.0) / (2.0 * p.hardest)
    share = np.maximum(room - used, np.where(held, 0.5 * room, 0.0))
    if p.others_drive:
        share = np.where(held, share, np.minimum(share, np.maximum(0.5 * room, 0.0)))
    # If the other may be within the separation already, its direction is uncertain within a lens:
    # the circle of its error around the estimate, outside of the separation circle around the car.
    error, least = DIRECTION * q.sigma, p.separation
    cosine = (least * least + d * d - error * error) / (2.0 * least * d)
    spread = np.where(d < least + error, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
    spread = np.where(d + error < least, np.arcsin(np.minimum(error / d, 1.0)), spread)
    return approach(m, p, towards, share, spread, _judged(q))


def fence(m: Moment, p: SafetyParams) -> Verdict:
    """The fence is nearer than the car needs to stop, or the car's position in it is not known."""
    if p.fence is None:
        return _capped(np.full(m.t_last_message.shape, FREE), _never(m))
    q = m.picture
    placed = (q.placed == 1.0) & np.isfinite(q.place).all(axis=-1) & (q.place_sigma >= 0)
    corners = np.array(p.fence.corners)
    margin = p.confidence * q.place_sigma
    inside, offset = to_edges(q.place, corners)
    away = np.hypot(offset[..., 0], offset[..., 1])
    out = placed & ~inside & ~(away.min(axis=-1) <= margin)
    # A position outside by less than the margin counts as an error: the car is set on the fence.
    nearest = np.take_along_axis(offset, away.argmin(axis=-1)[..., None, None], axis=-2)[..., 0, :]
    place = np.where(inside[..., None], q.place, q.place + nearest)
    _, offset = to_edges(place, corners)
    d = np.hypot(offset[..., 0], offset[..., 1])[..., None]
    towards = np.where(d > 1e-6, offset / np.maximum(d, 1e-6), outwards(corners))
    room = d[..., 0] - margin[..., None]
    near = approach(m, p, towards, room, np.zeros(()), np.ones(room.shape, dtype=bool))
    forward, backward = (np.where(placed, cap, 0.0) for cap in near[:2])
    return Verdict(forward, backward, out, near.left, near.right)


def _within(age: F64, limit: float) -> Bool:
    """Return whether ages are valid and at most the limit."""
    good: Bool = (age <= limit) & (age >= -AHEAD)
    return good


def _others(q: Picture) -> Bool:
    """Return the pairs of cars that may be present, (env, car, other)."""
    here = q.present != 0.0
    both: Bool = here[:, :, None] & here[:, None, :]
    return both & ~np.eye(here.shape[1], dtype=bool)


def _judged(q: Picture) -> Bool:
    """Return the pairs whose position is known, so that its covariance is checked."""
    known = (q.status == Status.OK) | (q.status == Status.LOST)
    judged: Bool = known & np.isfinite(q.pos).all(axis=-1) & _others(q)
    return judged


def _capped(cap: F64, hold: Bool) -> Verdict:
    return Verdict(cap, cap, hold)


def _held(hold: Bool) -> Verdict:
    return _capped(np.where(hold, 0.0, FREE), hold)


def _never(m: Moment) -> Bool:
    return np.zeros(m.t_last_message.shape, dtype=bool)


RULES = (
    Rule(
        "silence", silence, "the deciding process gave no sign of life",
        "stops for good after `silence`",
    ),
    Rule("link", link, "the car's port is lost", "stops for good"),
    Rule("fault", fault, "its controller reports a fault", "stops for good"),
    Rule(
        "runaway", runaway, "it is faster than it was asked to be",
        "stops for good where it is by `runaway_speed` for `runaway_time`",
    ),
    Rule(
        "deaf", deaf, "it does not execute commands",
        "stops for good without an answer, or a word of its speed, for `answer_time` (controllers "
        "that give them), or when its wheels are at rest for `idle_time` although it is asked to "
        "drive",
    ),
    Rule(
        "battery", battery, "its battery is nearly empty",
        "`slow` below `cell_slow`, stops for good below `cell_stop`",
    ),
    Rule("absent", absent, "it takes no part", "stops for good"),
    Rule(
        "stale", stale, "no message from its node, or no estimate",
        "`slow` after `stale_slow`, stops for good after `stale_stop`",
    ),
    Rule("covariance", covariance, "a covariance is not positive definite", "stops for good"),
    Rule(
        "sigma", sigma, "where another car is, is not known well enough",
        "`slow` above `sigma_slow`, stops for good above `sigma_stop`",
    ),
    Rule(
        "unknown", unknown, "the position of another car is not known",
        "`slow` (not where ranges contradict each other), and half of what the last range leaves; "
        "stops while that is older than `range_limit`, and stops for good if there was none",
    ),
    Rule("heading", lost_heading, "the heading is not known", "stops until it is"),
    Rule(
        "separation", separation, "another car is too near to go on",
        "only as fast, and turning towards it only as far, as leaves both their ways to a stop",
    ),
    Rule(
        "fence", fence, "the fence is too near to go on",
        "only as fast, and turning towards it only as far, as leaves the way to a stop; stops for "
        "good outside",
    ),
)  # fmt: skip
"""Rules in the order in which reasons are reported."""
