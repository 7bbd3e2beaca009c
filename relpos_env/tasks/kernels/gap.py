"""Compiled update of cars in single file along individual routes.

The route of a car is a polyline from its initial position to its final slot. The car waits for
those ahead of it: its goal is the point of the polyline at max(0, v t - lag).
"""

from __future__ import annotations

import math

from relpos_env.tasks.kernels.score import (
    all_within,
    changed,
    common_terms,
    formation_error,
    targets_from_goals,
    time_term,
)
from tracking.kernels.jit import kernel

PROGRESS_SCALE = 1.0
"""[m] Distance from the goal at which the progress term is exp(-1)."""


@kernel
def update_gap(
    start, stop, pos, accel, clear, present, t, collided, assigned, route, lag, limits, target,
    plan, goal, error, rewards, done,
):  # fmt: skip
    """Write goals, plan, error, rewards and end of the environments from start to stop.

    Args:
        start: First environment.
        stop: One past the last environment.
        pos: Positions, (env, car, 2) [m].
        accel: Accelerations, (env, car, 2) [m/s2].
        clear: Clearance to the nearest object, (env, car) [m].
        present: True where the car is present, (env, car).
        t: Time since the start of the episode, (env) [s].
        collided: Number of contacts begun in the step, (env, car).
        assigned: True where the car has a route, (env, car).
        route: x, y and arc length from the start, (env, car, point, 3) [m]; shorter routes
            repeat their last point.
        lag: Arc length by which a car starts late, (env, car) [m].
        limits: Speed [m/s], tolerance at the end [m], scale of the error [m].
        target: Relative targets, (env, car, other, 2) [m], written.
        plan: Reference velocities, (env, car, 2) [m/s], written.
        goal: Goal positions, (env, car, 2) [m], written.
        error: Formation error, (env, car) [m], written.
        rewards: Reward terms, (env, car, term), written.
        done: True where the task is done, (env), written.

    Returns:
        Number of environments whose assignment is out of date; these are not written.
    """
    speed, tolerance, error_scale = limits
    last = route.shape[2] - 1
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, assigned):
            n_changed += 1
            continue
        arrived = True
        for k in range(present.shape[1]):
            goal[env, k, 0] = goal[env, k, 1] = 0.0
            plan[env, k, 0] = plan[env, k, 1] = 0.0
            if not present[env, k]:
                continue
            s = speed * t[env] - lag[env, k]
            point = 0
            while point < last and route[env, k, point + 1, 2] <= s:
                point += 1
            goal[env, k, 0] = route[env, k, point, 0]
            goal[env, k, 1] = route[env, k, point, 1]
            if point < last:
                arrived = False
                segment = route[env, k, point + 1, 2] - route[env, k, point, 2]
                if s >= 0.0 and segment > 0.0:
                    along = (s - route[env, k, point, 2]) / segment
                    d_x = route[env, k, point + 1, 0] - route[env, k, point, 0]
                    d_y = route[env, k, point + 1, 1] - route[env, k, point, 1]
                    goal[env, k, 0] += along * d_x
                    goal[env, k, 1] += along * d_y
                    plan[env, k, 0] = speed * d_x / segment
                    plan[env, k, 1] = speed * d_y / segment
            off = math.hypot(pos[env, k, 0] - goal[env, k, 0], pos[env, k, 1] - goal[env, k, 1])
            rewards[env, k, 1] = math.exp(-off / PROGRESS_SCALE)
        targets_from_goals(env, present, goal, target)
        formation_error(env, pos, present, target, error)
        done[env] = arrived and all_within(env, pos, present, goal, tolerance)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
        time_term(env, present, done[env], rewards)
    return n_changed
