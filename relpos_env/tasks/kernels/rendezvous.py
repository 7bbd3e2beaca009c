"""Compiled update of the `rendezvous` task."""

from __future__ import annotations

import math

from relpos_env.tasks.kernels.score import changed, common_terms, time_term
from tracking.kernels.jit import kernel

CLOSING_SPEED = 1.0
"""[m/s] Speed towards the middle of the group at which the progress term is 1."""


@kernel
def update_meeting(
    start, stop, pos, vel, accel, clear, present, t, collided, assigned, place, since, limits, goal,
    error, rewards, done,
):  # fmt: skip
    """Write goals, error, rewards and end of the environments from start to stop.

    The plan and the targets stay 0.

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
        assigned: Cars present at the last assignment, (env, car).
        place: Meeting point, (env, 2) [m].
        since: Time since which all are within the radius, else infinite, (env) [s], updated.
        limits: Radius [m], time to stay [s], scale of the error [m].
        goal: Goal positions, (env, car, 2) [m], written.
        error: Distance from the group's mean position beyond the radius, (env, car) [m], written.
        rewards: Reward terms, (env, car, term), written.
        done: True where the task is done, (env), written.

    Returns:
        Number of environments whose set of cars has changed; these are not written.
    """
    radius, stay, error_scale = limits
    n = present.shape[1]
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, assigned):
            n_changed += 1
            continue
        x, y, v_x, v_y, n_present = 0.0, 0.0, 0.0, 0.0, 0
        for k in range(n):
            if present[env, k]:
                x, y = x + pos[env, k, 0], y + pos[env, k, 1]
                v_x, v_y = v_x + vel[env, k, 0], v_y + vel[env, k, 1]
                n_present += 1
        share = 1.0 / max(n_present, 1)
        together = n_present > 0
        for k in range(n):
            goal[env, k, 0] = goal[env, k, 1] = error[env, k] = 0.0
            if not present[env, k]:
                continue
            goal[env, k, 0], goal[env, k, 1] = place[env, 0], place[env, 1]
            d_x, d_y = share * x - pos[env, k, 0], share * y - pos[env, k, 1]
            distance = math.sqrt(d_x * d_x + d_y * d_y)
            rewards[env, k, 1] = 0.0
            if distance > radius:
                together = False
                error[env, k] = distance - radius
                closing = d_x * (vel[env, k, 0] - share * v_x)
                closing += d_y * (vel[env, k, 1] - share * v_y)
                rewards[env, k, 1] = min(max(closing / (distance * CLOSING_SPEED), -1.0), 1.0)
        since[env] = min(since[env], t[env]) if together else math.inf
        done[env] = together and t[env] - since[env] >= stay - 1e-9
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
        time_term(env, present, done[env], rewards)
    return n_changed
