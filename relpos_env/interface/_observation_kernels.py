"""Compiled observation vectors of a view, in the body frame of each car: x forward, y left."""

from __future__ import annotations

import math

from relpos_env.interface.rangefinders import FARTHEST
from tracking.kernels.jit import kernel, small_kernel

FAR, FAST = 20.0, 10.0
"""[m], [m/s] Limits of positions and velocities."""
OLD = 10.0
"""[s] Limit of ages."""
LOUD = 40.0
"""[dB] Limit of power differences."""
N_STATUS = 6


@small_kernel
def put(out, e, a, k, value, limit):
    """Write one number, clipped to its limit."""
    out[e, a, k] = min(max(value, -limit), limit)


@small_kernel
def put_turned(out, e, a, k, x, y, c, s, limit):
    """Rotate a vector from the world frame to the car's body frame and write it."""
    put(out, e, a, k, c * x + s * y, limit)
    put(out, e, a, k + 1, c * y - s * x, limit)


@small_kernel
def put_own(view, out, e, a, k, c, s):
    """Write the last fields of every mode: command, heading, own motion (6 numbers), ranges."""
    put_turned(out, e, a, k, view.command[e, a, 0], view.command[e, a, 1], c, s, FAST)
    known = 1.0 if view.oriented[e, a] else 0.0
    put(out, e, a, k + 2, known * c, 1.0)
    put(out, e, a, k + 3, known * s, 1.0)
    put(out, e, a, k + 4, view.speed[e, a], FAST)
    put(out, e, a, k + 5, view.steering[e, a], FAST)
    for b in range(view.near.shape[2]):
        put(out, e, a, k + 6 + b, view.near[e, a, b], FARTHEST)


@small_kernel
def put_targets(view, out, e, a, k, c, s):
    """Write the targets of the other cars: mask and positions (3 numbers each)."""
    n = view.ok.shape[1]
    for b in range(n):
        if b == a:
            continue
        o = b if b < a else b - 1
        has_target = view.has_target[e, a, b]
        out[e, a, k + o] = 1.0 if has_target else 0.0
        x, y = view.target[e, a, b, 0], view.target[e, a, b, 1]
        at = k + n - 1 + 2 * o
        if has_target:
            put_turned(out, e, a, at, x, y, c, s, FAR)
        else:
            out[e, a, at], out[e, a, at + 1] = 0.0, 0.0


@kernel
def observe_relative(view, with_cov, out):
    """Write relative positions and velocities, with their uncertainty if `with_cov`.

    Args:
        view: AgentView.
        with_cov: True to add covariance, age, NLOS probability and status.
        out: Observations, (env, car, size), written; zeros for absent cars.
    """
    n = view.ok.shape[1]
    others = n - 1
    for e in range(out.shape[0]):
        for a in range(n):
            if not view.present[e, a]:
                for k in range(out.shape[2]):
                    out[e, a, k] = 0.0
                continue
            c, s = math.cos(view.heading[e, a]), math.sin(view.heading[e, a])
            for b in range(n):
                if b == a:
                    continue
                o = b if b < a else b - 1
                ok = 1.0 if view.ok[e, a, b] else 0.0
                out[e, a, o] = ok
                x, y = ok * view.pos[e, a, b, 0], ok * view.pos[e, a, b, 1]
                put_turned(out, e, a, others + 2 * o, x, y, c, s, FAR)
                x, y = ok * view.vel[e, a, b, 0], ok * view.vel[e, a, b, 1]
                put_turned(out, e, a, 3 * others + 2 * o, x, y, c, s, FAST)
            k = 5 * others
            if with_cov:
                put_certainty(view, out, e, a, k, c, s)
                k += (3 + 2 + N_STATUS) * others
            put_targets(view, out, e, a, k, c, s)
            put_own(view, out, e, a, k + 3 * others, c, s)


@small_kernel
def put_certainty(view, out, e, a, k, c, s):
    """Write std forward and left, their correlation, age, NLOS probability and status."""
    n = view.ok.shape[1]
    for b in range(n):
        if b == a:
            continue
        o = b if b < a else b - 1
        ok = view.ok[e, a, b]
        xx, yy, xy = view.cov[e, a, b, 0], view.cov[e, a, b, 1], view.cov[e, a, b, 2]
        ahead = math.sqrt(max(c * c * xx + 2.0 * c * s * xy + s * s * yy, 0.0))
        left = math.sqrt(max(s * s * xx - 2.0 * c * s * xy + c * c * yy, 0.0))
        mixed = c * s * (yy - xx) + (c * c - s * s) * xy
        product = ahead * left
        put(out, e, a, k + 3 * o, ahead if ok else 0.0, FAR)
        put(out, e, a, k + 3 * o + 1, left if ok else 0.0, FAR)
        put(out, e, a, k + 3 * o + 2, mixed / product if ok and product > 0.0 else 0.0, 1.0)
        at = k + 3 * (n - 1)
        put(out, e, a, at + o, view.age[e, a, b], OLD)
        put(out, e, a, at + n - 1 + o, view.nlos[e, a, b], 1.0)
        at += 2 * (n - 1) + N_STATUS * o
        for status in range(N_STATUS):
            out[e, a, at + status] = 1.0 if view.status[e, a, b] == status else 0.0


@kernel
def observe_ranges(view, out):
    """Write the last raw range of every pair, its age and its power difference.

    Args:
        view: AgentView.
        out: Observations, (env, car, size), written; zeros for absent cars.
    """
    n = view.ok.shape[1]
    others = n - 1
    for e in range(out.shape[0]):
        for a in range(n):
            if not view.present[e, a]:
                for k in range(out.shape[2]):
                    out[e, a, k] = 0.0
                continue
            c, s = math.cos(view.heading[e, a]), math.sin(view.heading[e, a])
            for b in range(n):
                if b == a:
                    continue
                o = b if b < a else b - 1
                age = view.now[e] - view.t_last_range[e, a, b]
                fresh = age <= OLD
                out[e, a, o] = 1.0 if fresh else 0.0
                put(out, e, a, others + o, view.distance[e, a, b] if fresh else 0.0, FAR)
                put(out, e, a, 2 * others + o, age if fresh else 0.0, OLD)
                put(out, e, a, 3 * others + o, view.gap[e, a, b] if fresh else 0.0, LOUD)
            put_targets(view, out, e, a, 4 * others, c, s)
            put_own(view, out, e, a, 7 * others, c, s)
