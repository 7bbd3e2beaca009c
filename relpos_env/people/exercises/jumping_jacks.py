"""Jumping jacks: hops that open and close the feet while the arms go up and down.

In flight the pelvis follows a ballistic parabola; between flights it follows the quintic that
matches height, speed and acceleration at touchdown and at take-off. Feet move in flight only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from relpos_env.people.easing import bump, ease, join
from relpos_env.people.exercises.base import Bout, step_times, too_long
from relpos_env.people.path import Path
from relpos_env.people.pose import STANCE, Pose, ball_at
from relpos_env.people.skeleton_size import SkeletonSize
from tracking.arrays import F64
from tracking.geometry import GRAVITY
from tracking.params.short_repr import short_repr

WIND_UP = 0.45
"""[s] Time from standing to the first take-off, and from the last touchdown to standing."""
CLEARANCE = 0.4
"""[-] Rise of the feet as a share of the height of the hop."""
PUSH, HEEL = 0.12, 1.1
"""[s, rad] Time by which the heels leave the floor before the toes, and angle of their lift."""


@dataclass(frozen=True, slots=True)
class Hops:
    """Flight times of the person."""

    __repr__ = short_repr

    off: F64
    """Times of take-off, (hop) [s]."""
    on: F64
    """Times of touchdown, (hop) [s]."""

    @property
    def seconds(self) -> float:
        """Duration from standing to standing [s]."""
        return float(self.on[-1]) + WIND_UP

    def height(self, t: F64, flight: float, standing: float) -> F64:
        """Return the height of the pelvis, (time) [m].

        Args:
            t: Times, (time) [s].
            flight: Height at every take-off and touchdown [m].
            standing: Height before and after the bout [m].
        """
        z = np.full(len(t), standing)
        speed = 0.5 * GRAVITY * (self.on - self.off)
        rest = (standing, 0.0, 0.0)
        first, last = t < self.off[0], (t >= self.on[-1]) & (t < self.seconds)
        z[first] = join(t[first], float(self.off[0]), rest, (flight, speed[0], -GRAVITY))
        z[last] = join(t[last] - self.on[-1], WIND_UP, (flight, -speed[-1], -GRAVITY), rest)
        for k, (off, on) in enumerate(zip(self.off, self.on, strict=True)):
            air = (t >= off) & (t < on)
            since = t[air] - off
            z[air] = flight + since * (speed[k] - 0.5 * GRAVITY * since)
            if k + 1 < len(self.off):
                down = (t >= on) & (t < self.off[k + 1])
                z[down] = join(
                    t[down] - on,
                    float(self.off[k + 1] - on),
                    (flight, -speed[k], -GRAVITY),
                    (flight, speed[k + 1], -GRAVITY),
                )
        return z

    def aloft(self, t: F64) -> tuple[F64, F64]:
        """Return the completed share of each flight, (hop, time), and its height, (hop) [m]."""
        share = (t - self.off[:, None]) / (self.on - self.off)[:, None]
        return share, GRAVITY / 8.0 * (self.on - self.off) ** 2


def jumping_jacks(
    size: SkeletonSize, path: Path, way: float, dt: float, rng: np.random.Generator
) -> Bout:
    """Return a bout of 6 to 14 jumping jacks, 0.9 s to 1.2 s each.

    Args:
        size: Size of the person.
        path: Path of the person, who stays in place.
        way: Position along the path [m].
        dt: Time step [s].
        rng: Generator of number, rate and reach.
    """
    n = 2 * int(rng.integers(6, 15))
    period, share = rng.uniform([0.46, 0.36], [0.60, 0.44])
    every = period * rng.uniform(0.96, 1.04, n)
    on = WIND_UP + share * every[0] + np.concatenate([[0.0], np.cumsum(every[1:])])
    hops = Hops(on - share * every, on)
    t = step_times(hops.seconds, dt)
    wide, up, bend, forward = rng.uniform([0.22, 1.7, 0.2, 0.0], [0.36, 2.4, 0.7, 0.25])
    pos, heading = path.at(np.full(len(t), way))
    pose = Pose.standing(size, pos, heading)
    aloft, rise = hops.aloft(t)
    opening = np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    apart = STANCE + (wide - STANCE) * (opening[:, None] * ease(aloft)).sum(axis=0)
    ball = ball_at(size, pos, heading, apart)
    ball[..., 2] = (CLEARANCE * rise[:, None] * bump(aloft)).sum(axis=0)[:, None]
    lift = bump((t - hops.off[:, None] + PUSH) / ((hops.on - hops.off)[:, None] + 2.0 * PUSH))
    arms = 0.5 * (1.0 - np.cos(np.pi * _count(hops, t)))[:, None] * np.ones(2)
    pose = replace(
        pose,
        ball_w=ball,
        heel_lift=HEEL * lift.sum(axis=0)[:, None] * np.ones(2),
        abduction=pose.abduction + up * arms,
        flexion=pose.flexion + forward * arms,
        roll=pose.roll + 0.4 * arms,
        elbow=pose.elbow + bend * arms * (1.2 - arms),
    )
    standing = float(pose.pelvis_w[0, 2])
    flight = standing + 0.04
    for _ in range(6):
        pelvis = pose.pelvis_w.copy()
        pelvis[:, 2] = hops.height(t, flight, standing)
        pose = replace(pose, pelvis_w=pelvis)
        flight -= 1.1 * float(too_long(size, pose).max())
    return Bout(pose=pose, way=way)


def _count(hops: Hops, t: F64) -> F64:
    """Return the number of hops done, rising smoothly from 0 to their total, (time)."""
    between = 0.5 * (hops.on[:-1] + hops.off[1:])
    knots = np.concatenate([[0.5 * hops.off[0]], between, [hops.seconds - 0.1]])
    spline = CubicSpline(knots, np.arange(len(hops.on) + 1.0), bc_type="clamped")
    return np.asarray(spline(np.clip(t, knots[0], knots[-1])))
