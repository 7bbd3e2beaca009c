"""Cars one behind the other along routes of their own, compiled.

Each car has a polyline from where it stood to its place at the end, and waits until the cars
before it are under way: its goal is the point of the polyline at max(0, v t - lag).
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
    start, stop, pos, accel, clear, present, t, collided, seated, route, lag, limits, target, plan,
    goal, error, rewards, done,
):  # fmt: skip
    """Goals, plan, error, rewards and ending of the environments from start to stop.

    Args:
        start: First environment.
        stop: One behind the last.
        pos: (env, car, 2) [m].
        accel: (env, car, 2) [m/s2].
        clear: Way to what is nearest, (env, car) [m].
        present: (env, car).
        t: (env) [s].
        collided: (env, car).
        seated: Who has a route, (env, car).
        route: x, y and arc from the route's start, (env, car, point, 3) [m]; the last point
            repeated where a route has fewer.
        lag: Arc by which a car is later than one that leaves at once, (env, car) [m].
        limits: Speed [m/s], tolerance at the end [m], scale of the error [m].
        target: (env, car, other, 2) [m], written.
        plan: (env, car, 2) [m/s], written.
        goal: (env, car, 2) [m], written.
        error: (env, car) [m], written.
        rewards: (env, car, term), written.
        done: (env), written.

    Returns:
        How many environments have other cars than were given routes; those are left alone.
    """
    speed, tolerance, error_scale = limits
    last = route.shape[2] - 1
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, seated):
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
                leg = route[env, k, point + 1, 2] - route[env, k, point, 2]
                if s >= 0.0 and leg > 0.0:
                    along = (s - route[env, k, point, 2]) / leg
                    d_x = route[env, k, point + 1, 0] - route[env, k, point, 0]
                    d_y = route[env, k, point + 1, 1] - route[env, k, point, 1]
                    goal[env, k, 0] += along * d_x
                    goal[env, k, 1] += along * d_y
                    plan[env, k, 0] = speed * d_x / leg
                    plan[env, k, 1] = speed * d_y / leg
            off = math.hypot(pos[env, k, 0] - goal[env, k, 0], pos[env, k, 1] - goal[env, k, 1])
            rewards[env, k, 1] = math.exp(-off / PROGRESS_SCALE)
        targets_from_goals(env, present, goal, target)
        formation_error(env, pos, present, target, error)
        done[env] = arrived and all_within(env, pos, present, goal, tolerance)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
        time_term(env, present, done[env], rewards)
    return n_changed
