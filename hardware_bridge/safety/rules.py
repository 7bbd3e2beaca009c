"""The rules of the gate, a table: each caps speeds, and may stop a car for good.

A rule looks at the picture and the clock, array over (env, car), and remembers nothing but what
hysteresis needs. `docs/safety.md` has the table in words.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hardware_bridge.safety.braking import stopping_speed, stopping_way
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from tracking.arrays import F64, Bool
from tracking.estimate import Status

FREE = np.inf
SWERVE = 0.5
"""[-] Sine of how far a car may turn towards something while it brakes from any speed."""
SWERVE_SLOW = 0.15
"""[-] Likewise when it is slow."""


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
    was_slow: Bool
    """Whether the last verdict of this rule capped or stopped, (env, car): for hysteresis."""


class Verdict(NamedTuple):
    """What a rule says of every car."""

    forward: F64
    """Speed at most, (env, car) [m/s]."""
    backward: F64
    """Likewise, backwards."""
    hold: Bool
    """Stop for good: only arming again lets it move, (env, car)."""


class Rule(NamedTuple):
    """One line of the table."""

    name: str
    check: Callable[[Moment, SafetyParams], Verdict]
    meaning: str


def silence(m: Moment, p: SafetyParams) -> Verdict:
    """The process that decides hangs, was stopped or is gone."""
    quiet: Bool = np.zeros(m.heard.shape, dtype=bool) | (m.now - m.word > p.silence)[:, None]
    return _capped(np.where(quiet, 0.0, FREE), quiet)


def stale(m: Moment, p: SafetyParams) -> Verdict:
    """What is known of the car is old: its node was not heard, or nothing was estimated."""
    age = m.now[:, None] - np.minimum(m.heard, m.picture.t[:, None])
    cap = np.where(age > p.stale_stop, 0.0, np.where(age > p.stale_slow, p.slow, FREE))
    return _capped(cap, age > p.stale_stop)


def covariance(m: Moment, p: SafetyParams) -> Verdict:
    """A covariance is none: not finite, not symmetric or not positive definite."""
    bad: Bool = np.any(_judged(m.picture) & (m.picture.sound == 0.0), axis=-1)
    return _capped(np.where(bad, 0.0, FREE), bad)


def sigma(m: Moment, p: SafetyParams) -> Verdict:
    """Where another is, is not known well enough."""
    worst = np.where(_judged(m.picture), m.picture.sigma, 0.0).max(axis=-1)
    # NaN compares as False; it is a matter of `covariance`, but must not pass for small here.
    over = np.logical_not(worst <= p.sigma_slow * np.where(m.was_slow, p.hysteresis, 1.0))
    far = np.logical_not(worst <= p.sigma_stop)
    return _capped(np.where(far, 0.0, np.where(over, p.slow, FREE)), far)


def unknown(m: Moment, p: SafetyParams) -> Verdict:
    """The position of another is not known yet, or its ranges contradict each other."""
    q = m.picture
    unsure = _others(q) & ~_judged(q)
    old = unsure & ~(m.now[:, None, None] - q.ranged <= p.range_limit)
    hold: Bool = np.any(old, axis=-1)
    slow: Bool = np.any(unsure, axis=-1)
    # Only the distance is known: whichever way the car goes may be the wrong one.
    way = np.where(unsure, q.distance - p.separation, FREE).min(axis=-1, initial=FREE)
    cap = np.minimum(p.slow, stopping_speed(way, p.reaction, p.braking))
    return _capped(np.where(hold, 0.0, np.where(slow, cap, FREE)), hold)


def lost_heading(m: Moment, p: SafetyParams) -> Verdict:
    """The car does not know where it points."""
    return _capped(np.where(m.picture.oriented == 0.0, 0.0, FREE), _never(m))


def link(m: Moment, p: SafetyParams) -> Verdict:
    """The car's own port is lost."""
    return _capped(np.where(m.linked, FREE, 0.0), ~m.linked)


def separation(m: Moment, p: SafetyParams) -> Verdict:
    """Another car is nearer than both need to stop."""
    q = m.picture
    known = _others(q) & _judged(q)
    elapsed = (m.now - q.t)[:, None, None, None]
    pos = q.pos + np.where(np.isfinite(elapsed), elapsed, 0.0) * q.vel
    d = np.maximum(np.hypot(pos[..., 0], pos[..., 1]), 1e-9)
    towards = pos / d[..., None]
    ahead = np.stack([np.cos(q.heading), np.sin(q.heading)], axis=-1)
    own = (q.speed[..., None] * ahead)[:, :, None]
    their = -((own + q.vel) * towards).sum(axis=-1)
    room = d - p.separation - p.confidence * q.sigma - stopping_way(their, p.reaction, p.braking)
    approach = (ahead[:, :, None] * towards).sum(axis=-1)
    caps = (_approached(room, sign * approach, known, p).min(axis=-1) for sign in (1.0, -1.0))
    forward, backward = caps
    return Verdict(forward, backward, _never(m))


def fence(m: Moment, p: SafetyParams) -> Verdict:
    """The fence is nearer than the car needs to stop, or its place in it is not known."""
    if p.fence is None:
        return _capped(np.full(m.heard.shape, FREE), _never(m))
    q = m.picture
    placed = q.placed == 1.0
    elapsed = np.maximum(m.now - q.t, 0.0)[:, None]
    ahead = np.stack([np.cos(q.heading), np.sin(q.heading)], axis=-1)
    moved = np.where(np.isfinite(elapsed), elapsed, 0.0) * q.speed
    place = q.place + moved[..., None] * ahead
    inside, offset = to_edges(place, np.array(p.fence.corners))
    d = np.hypot(offset[..., 0], offset[..., 1])
    margin = p.confidence * q.place_sigma
    out = placed & ~inside & (d.min(axis=-1) > margin)
    towards = offset / np.maximum(d, 1e-9)[..., None] * np.where(inside, 1.0, -1.0)[..., None, None]
    room = np.where(inside[..., None], d, -d) - margin[..., None]
    approach = (ahead[:, :, None] * towards).sum(axis=-1)
    everywhere = np.ones(room.shape, dtype=bool)
    forward, backward = (
        np.where(placed, _approached(room, sign * approach, everywhere, p).min(axis=-1), 0.0)
        for sign in (1.0, -1.0)
    )
    return Verdict(forward, backward, out)


def to_edges(place: F64, corners: F64) -> tuple[Bool, F64]:
    """Whether places are inside a polygon, and the way to the nearest point of each edge.

    Args:
        place: (..., 2) [m]
        corners: (corner, 2) [m]

    Returns:
        Inside, (...); offsets to the edges, (..., corner, 2) [m].
    """
    a, b = corners, np.roll(corners, -1, axis=0)
    edge, from_a = b - a, place[..., None, :] - a
    along = np.clip((from_a * edge).sum(axis=-1) / np.maximum((edge**2).sum(axis=-1), 1e-12), 0, 1)
    offset: F64 = a + along[..., None] * edge - place[..., None, :]
    y, x = place[..., None, 1], place[..., None, 0]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(edge[:, 1] == 0.0, 1.0, edge[:, 1])
    crosses = spans & (x < a[:, 0] + (y - a[:, 1]) / rise * edge[:, 0])
    inside: Bool = crosses.sum(axis=-1) % 2 == 1
    return inside, offset


def _approached(room: F64, approach: F64, counts: Bool, p: SafetyParams) -> F64:
    """Speed at most, by the room to things [m] and the cosine of the angle towards each."""
    speed = stopping_speed(room, p.reaction, p.braking)
    fast = speed / np.clip(approach + SWERVE, 1e-9, 1.0)
    slow = np.minimum(p.slow, speed / np.clip(approach + SWERVE_SLOW, 1e-9, 1.0))
    fast = np.where(approach + SWERVE <= 0.0, FREE, fast)
    slow = np.where(approach + SWERVE_SLOW <= 0.0, p.slow, slow)
    return np.where(counts, np.maximum(fast, slow), FREE)


def _others(q: Picture) -> Bool:
    """Pairs of present cars, (env, car, other)."""
    here = q.present == 1.0
    both: Bool = here[:, :, None] & here[:, None, :]
    return both & ~np.eye(here.shape[1], dtype=bool)


def _judged(q: Picture) -> Bool:
    """Pairs whose position is said to be known, and so is judged by its covariance."""
    known = (q.status == Status.OK) | (q.status == Status.LOST)
    judged: Bool = known & _others(q)
    return judged


def _capped(cap: F64, hold: Bool) -> Verdict:
    return Verdict(cap, cap, hold)


def _never(m: Moment) -> Bool:
    return np.zeros(m.heard.shape, dtype=bool)


RULES = (
    Rule("silence", silence, "the deciding process gave no sign of life"),
    Rule("link", link, "the car's port is lost"),
    Rule("stale", stale, "its node was not heard, or nothing was estimated"),
    Rule("covariance", covariance, "a covariance is not positive definite"),
    Rule("sigma", sigma, "where another car is, is not known well enough"),
    Rule("unknown", unknown, "the position of another car is not known"),
    Rule("heading", lost_heading, "the heading is not known"),
    Rule("separation", separation, "another car is too near to go on"),
    Rule("fence", fence, "the fence is too near to go on"),
)
"""In the order in which reasons are told."""
