"""Compiled update of the `escort` task."""

from __future__ import annotations

import math

from relpos_env.tasks.kernels.score import (
    changed,
    common_terms,
    formation_error,
    targets_from_goals,
    velocity_term,
)
from tracking.kernels.jit import kernel


@kernel
def update_escort(
    start, stop, pos, vel, accel, clear, present, collided, assigned, escorted, places, error_scale,
    target, goal, error, rewards,
):  # fmt: skip
    """Write goals, targets, error and rewards of the environments from start to stop.

    Args:
        start: First environment.
        stop: One past the last environment.
        pos: Positions, (env, car, 2) [m].
        vel: Velocities, (env, car, 2) [m/s].
        accel: Accelerations, (env, car, 2) [m/s2].
        clear: Clearance to the nearest object, (env, car) [m].
        present: True where the car is present, (env, car).
        collided: Number of contacts begun in the step, (env, car).
        assigned: Cars present at the last assignment, (env, car).
        escorted: Index of the escorted car, (env).
        places: Slots relative to the escorted car, (env, car, 2) [m].
        error_scale: Scale of the error [m].
        target: Targets, (env, car, other, 2) [m], written.
        goal: Goal positions, (env, car, 2) [m], written.
        error: Formation error, (env, car) [m], written.
        rewards: Reward terms, (env, car, term), written.

    Returns:
        Number of environments whose set of cars has changed; these are not written.
    """
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, assigned):
            n_changed += 1
            continue
        first = escorted[env]
        for k in range(present.shape[1]):
            here = 1.0 if present[env, k] else 0.0
            for a in range(2):
                goal[env, k, a] = here * places[env, k, a]
        # Targets of slots alone: they must not depend on true positions, not even by rounding.
        targets_from_goals(env, present, goal, target)
        for k in range(present.shape[1]):
            if present[env, k]:
                goal[env, k, 0] += pos[env, first, 0]
                goal[env, k, 1] += pos[env, first, 1]
                velocity_term(env, k, vel, vel[env, first, 0], vel[env, first, 1], rewards)
        formation_error(env, pos, present, target, error)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
    return n_changed


@kernel
def wander(pos, heading, escorted, t, waypoints, now, limits, speed, steering):
    """Write the command of the escorted car: to its next waypoint, with a rest at each.

    Args:
        pos: Positions, (env, car, 2) [m].
        heading: Headings, (env, car) [rad].
        escorted: Index of the escorted car, (env).
        t: Time since the start of the episode, (env) [s].
        waypoints: Waypoint and time of rest at it, (env, waypoint, 3) [m, s].
        now: Index of the waypoint, time at which the car set out for it [s], (env, 2), updated.
        limits: Speed [m/s], radius of a waypoint [m], longest time for one [s], steering per
            heading error [-], largest steering [rad].
        speed: Commanded speeds, (env, car) [m/s], written for the escorted car.
        steering: Commanded steering angles, (env, car) [rad], written for the escorted car.
    """
    fast, radius, longest, gain, most = limits
    for env in range(pos.shape[0]):
        k, at = escorted[env], int(now[env, 0])
        x, y = waypoints[env, at, 0] - pos[env, k, 0], waypoints[env, at, 1] - pos[env, k, 1]
        if math.hypot(x, y) < radius or t[env] > now[env, 1] + longest:
            now[env, 1] = t[env] + waypoints[env, at, 2]
            now[env, 0] = at = (at + 1) % waypoints.shape[1]
            x, y = waypoints[env, at, 0] - pos[env, k, 0], waypoints[env, at, 1] - pos[env, k, 1]
        ahead = math.atan2(y, x) - heading[env, k]
        ahead = math.atan2(math.sin(ahead), math.cos(ahead))
        steering[env, k] = min(max(gain * ahead, -most), most)
        speed[env, k] = 0.0 if t[env] < now[env, 1] else fast
