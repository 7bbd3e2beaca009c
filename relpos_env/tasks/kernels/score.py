"""Compiled parts common to all tasks: targets from goals, formation error, reward terms."""

from __future__ import annotations

import math

from tracking.kernels.jit import small_kernel

HARD_ACCEL = 5.0
"""[m/s2] Acceleration at which the effort term saturates at -1."""
TIME = 5
"""Index of the time term of tasks with an end."""
NEAR = 0.15
"""[m] Clearance below which the nearness term is not 0."""
FAR = 4.0
"""[-] Scale ratio of the two halves of the formation term: the wide half still has a gradient
metres away from the slot."""
VELOCITY_SCALE = 0.5
"""[m/s] Deviation from the reference velocity at which the velocity term is exp(-1)."""


@small_kernel
def changed(env, present, assigned):
    """True if the set of present cars differs from the set that slots were assigned to."""
    n_other = 0
    for k in range(present.shape[1]):
        n_other += present[env, k] != assigned[env, k]
    return n_other > 0


@small_kernel
def targets_from_goals(env, present, goal, target):
    """Write the relative targets of one environment, antisymmetric to the last bit.

    Args:
        env: Environment.
        present: True where the car is present, (env, car).
        goal: Goal positions in the room, (env, car, 2) [m].
        target: Relative targets, (env, car, other, 2) [m], written; 0 where either is absent.
    """
    n = present.shape[1]
    for i in range(n):
        for j in range(n):
            if present[env, i] and present[env, j]:
                target[env, i, j, 0] = goal[env, j, 0] - goal[env, i, 0]
                target[env, i, j, 1] = goal[env, j, 1] - goal[env, i, 1]
            else:
                target[env, i, j, 0] = 0.0
                target[env, i, j, 1] = 0.0


@small_kernel
def formation_error(env, pos, present, target, error):
    """Write the mean distance of other present cars from their targets, error (env, car) [m]."""
    n = present.shape[1]
    others = -1
    for i in range(n):
        error[env, i] = 0.0
        if present[env, i]:
            others += 1
    if others < 1:
        return
    for i in range(n):
        if not present[env, i]:
            continue
        for j in range(i + 1, n):
            if present[env, j]:
                x = pos[env, j, 0] - pos[env, i, 0] - target[env, i, j, 0]
                y = pos[env, j, 1] - pos[env, i, 1] - target[env, i, j, 1]
                distance = math.sqrt(x * x + y * y) / others
                error[env, i] += distance
                error[env, j] += distance


@small_kernel
def all_within(env, pos, present, goal, tolerance):
    """True if a car is present and all present cars are within a tolerance [m] of their goals."""
    anybody = False
    for k in range(present.shape[1]):
        if present[env, k]:
            anybody = True
            x, y = pos[env, k, 0] - goal[env, k, 0], pos[env, k, 1] - goal[env, k, 1]
            if x * x + y * y > tolerance * tolerance:
                return False
    return anybody


@small_kernel
def velocity_term(env, k, vel, reference_x, reference_y, rewards):
    """Write the second reward term of a car with a reference velocity [m/s]."""
    off = math.hypot(vel[env, k, 0] - reference_x, vel[env, k, 1] - reference_y)
    rewards[env, k, 1] = math.exp(-off / VELOCITY_SCALE)


@small_kernel
def place_term(env, pos, present, goal, scale, rewards):
    """Write the second reward term of a stationary formation, equal for all cars of the group."""
    x, y, n = 0.0, 0.0, 0
    for k in range(present.shape[1]):
        if present[env, k]:
            x += pos[env, k, 0] - goal[env, k, 0]
            y += pos[env, k, 1] - goal[env, k, 1]
            n += 1
    for k in range(present.shape[1]):
        if present[env, k]:
            rewards[env, k, 1] = math.exp(-math.hypot(x, y) / (n * scale))


@small_kernel
def common_terms(env, accel, clear, present, collided, error, error_scale, rewards):
    """Write the common reward terms; the task-specific second term must be written before.

    Args:
        env: Environment.
        accel: Accelerations, (env, car, 2) [m/s2].
        clear: Clearance to the nearest object, (env, car) [m].
        present: True where the car is present, (env, car).
        collided: Number of contacts begun in the step, (env, car).
        error: Formation error, (env, car) [m].
        error_scale: Error over which half of the formation term falls off to exp(-1) [m].
        rewards: Reward terms, (env, car, term), written: formation, (task-specific), collision,
            effort, nearness; all terms of an absent car are 0.
    """
    n_terms = rewards.shape[2]
    for k in range(present.shape[1]):
        if not present[env, k]:
            for term in range(n_terms):
                rewards[env, k, term] = 0.0
            continue
        square = accel[env, k, 0] ** 2 + accel[env, k, 1] ** 2
        off = error[env, k] / error_scale
        rewards[env, k, 0] = 0.5 * math.exp(-off) + 0.5 * math.exp(-off / FAR)
        rewards[env, k, 2] = -collided[env, k]
        rewards[env, k, 3] = -min(1.0, square / (HARD_ACCEL * HARD_ACCEL))
        short = max(1.0 - clear[env, k] / NEAR, 0.0)
        rewards[env, k, 4] = -short * short


@small_kernel
def time_term(env, present, done, rewards):
    """Write the last reward term of tasks with an end: -1 per step until the task is done.

    Args:
        env: Environment.
        present: True where the car is present, (env, car).
        done: True if the task of this environment is done.
        rewards: Reward terms, (env, car, term), written.
    """
    for k in range(present.shape[1]):
        if present[env, k]:
            rewards[env, k, TIME] = 0.0 if done else -1.0
