"""Places on a closed curve that all go round it, compiled.

The goal of a car and its velocity are ``g = c(s)``, ``g' = v c'(s)`` with ``s = s0 + v t``: the
curve c over its arc length, and an arc s0 of its own for every car.
"""

from __future__ import annotations

import math

from relpos_env.tasks.kernels.curve import curve_point
from relpos_env.tasks.kernels.score import (
    changed,
    common_terms,
    formation_error,
    targets_from_goals,
    velocity_term,
)
from tracking.kernels.jit import kernel


@kernel
def update_ring(
    start, stop, pos, vel, accel, clear, present, t, collided, seated, arc, curve, motion, target,
    plan, goal, error, rewards,
):  # fmt: skip
    """Goals, plan, error and rewards of the environments from start to stop.

    Args:
        start: First environment.
        stop: One behind the last.
        pos: (env, car, 2) [m].
        vel: (env, car, 2) [m/s].
        accel: (env, car, 2) [m/s2].
        clear: Way to what is nearest, (env, car) [m].
        present: (env, car).
        t: (env) [s].
        collided: (env, car).
        seated: Who has a place, (env, car).
        arc: Of each car's place at t = 0, (env, car) [m].
        curve: Coefficients of x and y, falling powers, (segment, 2, 4).
        motion: Length of the curve [m], speed [m/s], lookahead of the plan [s], scale of the
            error [m].
        target: (env, car, other, 2) [m], written.
        plan: (env, car, 2) [m/s], written.
        goal: (env, car, 2) [m], written.
        error: (env, car) [m], written.
        rewards: (env, car, term), written.

    Returns:
        How many environments have other cars than were given places; those are left alone.
    """
    length, speed, lookahead, error_scale = motion
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, seated):
            n_changed += 1
            continue
        for k in range(present.shape[1]):
            goal[env, k, 0] = goal[env, k, 1] = 0.0
            plan[env, k, 0] = plan[env, k, 1] = 0.0
            if not present[env, k]:
                continue
            s = arc[env, k] + speed * t[env]
            x, y, _, _, _, _ = curve_point(curve, length, s - length * math.floor(s / length))
            goal[env, k, 0], goal[env, k, 1] = x, y
            # The plan is that of a little later, which covers the cars' lag.
            s += speed * lookahead
            point = curve_point(curve, length, s - length * math.floor(s / length))
            plan[env, k, 0], plan[env, k, 1] = speed * point[2], speed * point[3]
            velocity_term(env, k, vel, plan[env, k, 0], plan[env, k, 1], rewards)
        targets_from_goals(env, present, goal, target)
        formation_error(env, pos, present, target, error)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
    return n_changed
