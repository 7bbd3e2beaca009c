"""Compiled model of the operators: perceived position errors and commanded velocities."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import kernel

_WHO = np.uint64(0xFFFFFFFFFFFFFFFF)
"""Counter of the draw that decides whether an episode has an operator; no sample has it."""


@kernel
def draw_gains(seeds, gain, share, gains):
    """Write the gains of episodes, (env) [1/s]: 0 in the share of them without an operator."""
    for env in range(seeds.shape[0]):
        trims = uniform(draw_key(seeds[env], _WHO), 0) < share
        gains[env] = gain if trims else 0.0


@kernel
def operate(
    start, stop, pos, present, plan, goal, seeds, counts, offset, seen, gains, limits, command
):  # fmt: skip
    """Write the commanded velocities of the cars of environments `start` to `stop`.

    Args:
        start: First environment.
        stop: One past the last environment.
        pos: Positions, (env, car, 2) [m].
        present: Mask of present cars, (env, car).
        plan: Planned velocities, (env, car, 2) [m/s].
        goal: Goal positions, (env, car, 2) [m].
        seeds: Seeds of the operators, (env) uint64.
        counts: Samples since the start of the episode, (env), updated.
        offset: Position error of the operator, (env, 2) [m], updated.
        seen: Perceived offset of the group at the last samples, (env, slot, 2) [m], updated.
        gains: Trim gains, (env) [1/s].
        limits: Largest trim [m/s], largest speed [m/s], standard deviation of the position error
            [m], and its correlation from sample to sample [-].
        command: Velocities, (env, car, 2) [m/s], written; 0 for absent cars.
    """
    max_trim, max_speed, std, keep = limits
    depth = seen.shape[1]
    for env in range(start, stop):
        count = counts[env]
        x, y, n = 0.0, 0.0, 0
        for k in range(present.shape[1]):
            if present[env, k]:
                x += pos[env, k, 0] - goal[env, k, 0]
                y += pos[env, k, 1] - goal[env, k, 1]
                n += 1
        if std > 0.0:
            key = draw_key(seeds[env], np.uint64(count))
            # The first draw has the full deviation, so the error is stationary.
            kept = keep if count > 0 else 0.0
            fresh = std * math.sqrt(1.0 - kept * kept)
            for axis in range(2):
                offset[env, axis] = kept * offset[env, axis] + fresh * normal(key, axis)
        slot = count % depth
        seen[env, slot, 0] = x / max(n, 1) + offset[env, 0]
        seen[env, slot, 1] = y / max(n, 1) + offset[env, 1]
        # Oldest sample: the slot written next or, until all slots are written, the first.
        late = (count + 1) % depth if count + 1 >= depth else 0
        trim_x, trim_y = -gains[env] * seen[env, late, 0], -gains[env] * seen[env, late, 1]
        length = math.hypot(trim_x, trim_y)
        if length > max_trim:
            trim_x, trim_y = trim_x * max_trim / length, trim_y * max_trim / length
        for k in range(present.shape[1]):
            v_x, v_y = 0.0, 0.0
            if present[env, k]:
                v_x, v_y = plan[env, k, 0] + trim_x, plan[env, k, 1] + trim_y
                speed = math.hypot(v_x, v_y)
                if speed > max_speed:
                    v_x, v_y = v_x * max_speed / speed, v_y * max_speed / speed
            command[env, k, 0], command[env, k, 1] = v_x, v_y
        counts[env] = count + 1
