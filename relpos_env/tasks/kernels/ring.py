"""Compiled update of slots that move along a closed curve.

The goal of a car and its velocity are ``g = c(s)``, ``g' = v c'(s)`` with ``s = s0 + v t``: the
curve c over its arc length, and the initial arc length s0 of the car.
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
    start, stop, pos, vel, accel, clear, present, t, collided, assigned, arc, curve, motion, target,
    plan, goal, error, rewards,
):  # fmt: skip
    """Write goals, plan, error and rewards of the environments from start to stop.

    Args:
        start: First environment.
        stop: One past the last environment.
        pos: Positions, (env, car, 2) [m].
        vel: Velocities, (env, car, 2) [m/s].
        accel: Accelerations, (env, car, 2) [m/s2].
        clear: Clearance to the nearest object, (env, car) [m].
        present: True where the car is present, (env, car).
        t: Time since the start of the episode, (env) [s].
        collided: Number of contacts begun in the step, (env, car).
        assigned: True where a slot is assigned, (env, car).
        arc: Arc length of each car's slot at t = 0, (env, car) [m].
        curve: Coefficients of x and y, falling powers, (segment, 2, 4).
        motion: Length of the curve [m], speed [m/s], lookahead of the plan [s], scale of the
            error [m].
        target: Relative targets, (env, car, other, 2) [m], written.
        plan: Reference velocities, (env, car, 2) [m/s], written.
        goal: Goal positions, (env, car, 2) [m], written.
        error: Formation error, (env, car) [m], written.
        rewards: Reward terms, (env, car, term), written.

    Returns:
        Number of environments whose assignment is out of date; these are not written.
    """
    length, speed, lookahead, error_scale = motion
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, assigned):
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
            # The plan is ahead by the lookahead, which compensates the lag of the cars.
            s += speed * lookahead
            point = curve_point(curve, length, s - length * math.floor(s / length))
            plan[env, k, 0], plan[env, k, 1] = speed * point[2], speed * point[3]
            velocity_term(env, k, vel, plan[env, k, 0], plan[env, k, 1], rewards)
        targets_from_goals(env, present, goal, target)
        formation_error(env, pos, present, target, error)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
    return n_changed
