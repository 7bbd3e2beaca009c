"""Compiled views of the other cars, from estimates or from the true state."""

from __future__ import annotations

import math

import numpy as np

from tracking.kernels.jit import kernel, small_kernel

ABSENT, OK = 0, 3
RANGE = 5


@kernel
def see_estimate(motion, rest, pair_i, pair_j, powered, turns, n_trackers, view):
    """Write the estimates of the trackers, predicted to `view.now` at constant velocity.

    Args:
        motion: Position, velocity, covariance of every pair, (tracker, pair, ...), and orientation
            of every node, (tracker, node, 4).
        rest: True where the orientation is known, (tracker, node); age, NLOS probability and
            status, (tracker, pair); and the time of the estimates, (tracker) [s].
        pair_i: Smaller node index of the pair, (pair).
        pair_j: Larger node index, (pair); nodes with indices above the cars' are skipped.
        powered: True where the car's tracker runs, (env, car).
        turns: Rotation of every car since the estimate, (env, car) [rad].
        n_trackers: Number of trackers per environment: one, or one per car.
        view: AgentView, written.
    """
    pos, vel, cov, q = motion
    has_q, age, nlos, status, t = rest
    is_own = n_trackers > 1
    for e in range(powered.shape[0]):
        for n in range(powered.shape[1]):
            r = e * n_trackers + n if is_own else e
            w, x, y, z = q[r, n, 0], q[r, n, 1], q[r, n, 2], q[r, n, 3]
            known = has_q[r, n] and powered[e, n]
            view.oriented[e, n] = known
            yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
            view.heading[e, n] = yaw + turns[e, n] if known else 0.0
        for p in range(pair_i.shape[0]):
            i, j = pair_i[p], pair_j[p]
            if j >= powered.shape[1]:
                continue
            for a, b, sign in ((i, j, 1.0), (j, i, -1.0)):
                on, r = powered[e, a], e * n_trackers + a if is_own else e
                dt = view.now[e] - t[r]
                view.ok[e, a, b] = on and status[r, p] == OK
                view.status[e, a, b] = status[r, p] if on else ABSENT
                view.age[e, a, b] = age[r, p] + dt if on else 0.0
                view.nlos[e, a, b] = nlos[r, p] if on else 0.0
                for k in range(2):
                    v = sign * vel[r, p, k] if on else 0.0
                    view.vel[e, a, b, k] = v
                    view.pos[e, a, b, k] = sign * pos[r, p, k] + dt * v if on else 0.0
                    view.cov[e, a, b, k] = carried(cov, r, p, k, k, dt) if on else 0.0
                view.cov[e, a, b, 2] = carried(cov, r, p, 0, 1, dt) if on else 0.0


@small_kernel
def carried(cov, e, p, r, k, dt):
    """Return an entry of the position covariance predicted by dt at constant velocity [m2]."""
    mixed = cov[e, p, r, 3 + k] + cov[e, p, 3 + r, k]
    return cov[e, p, r, k] + dt * (mixed + dt * cov[e, p, 3 + r, 3 + k])


@kernel
def see_truth(pos, vel, heading, view):
    """Write the true state; arguments as for `views.reveal`."""
    for e in range(pos.shape[0]):
        for a in range(pos.shape[1]):
            here = view.present[e, a]
            view.heading[e, a] = heading[e, a] if here else 0.0
            view.oriented[e, a] = here
            for b in range(pos.shape[1]):
                seen = here and a != b and view.present[e, b]
                view.ok[e, a, b] = seen
                view.status[e, a, b] = OK if seen else ABSENT
                view.age[e, a, b] = view.nlos[e, a, b] = 0.0
                for k in range(2):
                    view.pos[e, a, b, k] = pos[e, b, k] - pos[e, a, k] if seen else 0.0
                    view.vel[e, a, b, k] = vel[e, b, k] - vel[e, a, k] if seen else 0.0
                for k in range(3):
                    view.cov[e, a, b, k] = 0.0


@kernel
def note_ranges(t, kind, i, j, values, has_power, valid, view):
    """Store the last range of every pair of cars; arguments as in `MeasurementBlock`."""
    n_cars = view.t_last_range.shape[1]
    for e in range(t.shape[0]):
        for k in range(t.shape[1]):
            if not valid[e, k] or kind[e, k] != RANGE or max(i[e, k], j[e, k]) >= n_cars:
                continue
            for a, b in ((i[e, k], j[e, k]), (j[e, k], i[e, k])):
                if t[e, k] >= view.t_last_range[e, a, b]:
                    view.t_last_range[e, a, b] = t[e, k]
                    view.distance[e, a, b] = values[e, k, 0]
                    power = values[e, k, 1] - values[e, k, 2] if has_power[e, k] else 0.0
                    view.gap[e, a, b] = power


@kernel
def forget_all(view, e):
    """Clear the ranges of an environment."""
    for a in range(view.t_last_range.shape[1]):
        for b in range(view.t_last_range.shape[1]):
            view.t_last_range[e, a, b] = -np.inf
            view.distance[e, a, b] = 0.0
            view.gap[e, a, b] = 0.0
