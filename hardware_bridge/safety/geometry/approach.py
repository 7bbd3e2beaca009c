"""Limits of speed and steering given the clearance to obstacles.

From any permitted speed a car stops within the clearance, for any steering within the permitted
angles: `turning` has the path lengths, `braking` the speeds.
"""

from __future__ import annotations

import numpy as np

from hardware_bridge.safety.geometry.braking import stopping_speed
from hardware_bridge.safety.geometry.turning import way_within
from hardware_bridge.safety.moment import FREE, Moment, Verdict
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.picture import Picture
from tracking.arrays import F64, Bool

ABEAM = 0.7
"""[-] Sine of the angle to the heading above which an obstacle is abeam, not ahead or astern."""
CREEP = 0.02
"""[m] Distance to go at which a speed controller that follows a falling speed seems at rest."""
REAR = 0.16
"""[m] From the rear axle to the centre of a 1:10 car, which swings out when the car turns."""


def approach(
    m: Moment, p: SafetyParams, towards: F64, room: F64, spread: F64, counts: Bool
) -> Verdict:
    """Return the limits that obstacles impose on the cars.

    Args:
        m: Input of the rule.
        p: Limits.
        towards: Directions to the obstacles, (env, car, thing, 2).
        room: Clearance: distance by which cars may approach, (env, car, thing) [m].
        spread: Largest error of the directions, (env, car, thing) [rad].
        counts: True for obstacles that are present, (env, car, thing).
    """
    angle, on_left = bearing(ahead_of(m.picture)[:, :, None], towards)
    share = np.where(
        np.sin(angle) > ABEAM, np.minimum(np.maximum(room, 0.0) / p.turning_room, 1.0), 1.0
    )
    limit = p.max_steering * np.where(counts, share, 1.0)
    sides = m.recent.left[..., None], m.recent.right[..., None]
    bound = np.where(on_left, *sides)
    tightest = p.turning_radius * np.tan(p.max_steering)
    radius = tightest / np.maximum(np.tan(np.maximum(limit, bound)), 1e-3)
    # If it may not turn towards an obstacle at all, it may drive on while it turns away from it.
    away = m.recent.steering[..., None] * np.where(on_left, -1.0, 1.0)
    away = np.where(bound == 0.0, np.clip(away, 0.0, p.max_steering - limit), 0.0)
    turned = np.maximum(np.where(on_left, *sides[::-1]), limit)
    # The centre of a car moves off its heading in a turn: backwards, to the outside.
    inner, outer = REAR / radius, REAR / tightest * np.tan(turned)
    swings = np.arctan(inner) - np.arctan(REAR / tightest * np.tan(away)), np.arctan(outer)
    time = (p.reaction + age_of(m))[..., None]
    speeds = []
    for off, swing in zip((angle, np.pi - angle), swings, strict=True):
        way = way_within(
            room - CREEP, np.clip(off - swing - spread, 0.0, np.pi), np.hypot(radius, REAR)
        )
        cap = stopping_speed(way, time, p.braking)
        speeds.append(np.where(counts, cap, FREE).min(axis=-1))
    left, right = (
        np.where(side, limit, p.max_steering).min(axis=-1) for side in (on_left, ~on_left)
    )
    return Verdict(speeds[0], speeds[1], np.zeros(m.t_last_message.shape, dtype=bool), left, right)


def bearing(ahead: F64, towards: F64) -> tuple[F64, Bool]:
    """Return the angle between directions, 0 to pi [rad], and whether the second is to the left."""
    along = ahead[..., 0] * towards[..., 0] + ahead[..., 1] * towards[..., 1]
    left = ahead[..., 0] * towards[..., 1] - ahead[..., 1] * towards[..., 0]
    angle: F64 = np.arctan2(np.abs(left), along)
    return angle, left > 0.0


def ahead_of(q: Picture) -> F64:
    """Return the directions of the cars, (env, car, 2); NaN where the heading is unknown."""
    heading = np.where(np.isfinite(q.heading), q.heading, np.nan)
    return np.stack([np.cos(heading), np.sin(heading)], axis=-1)


def age_of(m: Moment) -> F64:
    """Return the age of the snapshot, (env, 1) [s]; 0 without one, as other rules stop the cars."""
    age = m.now - m.picture.t
    return np.clip(np.where(np.isfinite(age), age, 0.0), 0.0, 1.0)[:, None]
