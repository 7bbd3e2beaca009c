"""Compiled update of formation slots in a frame that moves along a curve and turns.

The goal of a car and its velocity are

    g = a + c(s) + R(psi) o,   s = s0 + v t,   psi = psi0 + w t (+ the curve's direction)
    g' = v c'(s) + psi' J R(psi) o,   J a rotation by 90 degrees to the left

with its slot o, the anchor a, and the curve c: a piecewise cubic over its arc length.
"""

from __future__ import annotations

import math

from relpos_env.tasks.kernels.curve import curve_point
from relpos_env.tasks.kernels.score import (
    all_within,
    changed,
    common_terms,
    formation_error,
    place_term,
    targets_from_goals,
    time_term,
    velocity_term,
)
from tracking.kernels.jit import kernel, small_kernel


@small_kernel
def frame_state(env, t, frame, curve, motion):
    """Return origin, cosine and sine of the heading, velocity and turning rate of the frame.

    Args:
        env: Environment.
        t: Time since the start of the episode [s].
        frame: Anchor x, y [m], initial arc length [m], initial heading [rad], (env, 4).
        curve: Coefficients of x and y, falling powers, (segment, 2, 4).
        motion: Speed [m/s], rate [rad/s], length of the curve [m], 1 if closed, 1 if the frame
            turns with the curve.
    """
    speed, rate, length, closed, turning = motion
    x, y, psi = frame[env, 0], frame[env, 1], frame[env, 3] + rate * t
    v_x, v_y, turn = 0.0, 0.0, rate
    if length > 0.0:
        s = frame[env, 2] + speed * t
        if closed > 0.0:
            s -= length * math.floor(s / length)
        elif s < 0.0 or s >= length:
            speed = 0.0
            s = min(max(s, 0.0), length)
        c_x, c_y, d_x, d_y, dd_x, dd_y = curve_point(curve, length, s)
        x += c_x
        y += c_y
        v_x, v_y = speed * d_x, speed * d_y
        if turning > 0.0:
            psi += math.atan2(d_y, d_x)
            turn += speed * (d_x * dd_y - d_y * dd_x) / (d_x * d_x + d_y * d_y)
    return x, y, math.cos(psi), math.sin(psi), v_x, v_y, turn


@kernel
def frame_now(env, t, frame, curve, motion, out):
    """Write `frame_state` of one environment into out (7)."""
    state = frame_state(env, t, frame, curve, motion)
    for k in range(7):
        out[k] = state[k]


@kernel
def update_frame(
    start, stop, pos, vel, accel, clear, present, t, collided, assigned, frame, places, curve,
    motion, limits, target, plan, goal, error, rewards, done,
):  # fmt: skip
    """Write goals, plan, error, rewards and end of the environments from start to stop.

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
        frame: As in `frame_state`.
        places: Slot x, y in the frame [m], and 1 for a car that receives the plan, else 0,
            (env, car, 3).
        curve: As in `frame_state`.
        motion: As in `frame_state`.
        limits: Lookahead of the plan [s], tolerance at the end [m], scale of the error [m],
            scale of the place term [m], 0 for a formation with a velocity term instead.
        target: Relative targets, (env, car, other, 2) [m], written.
        plan: Reference velocities, (env, car, 2) [m/s], written.
        goal: Goal positions, (env, car, 2) [m], written.
        error: Formation error, (env, car) [m], written.
        rewards: Reward terms, (env, car, term), written.
        done: True where the task is done, (env), written.

    Returns:
        Number of environments whose assignment is out of date; these are not written.
    """
    lookahead, tolerance, error_scale, place_scale = limits
    ends = motion[2] > 0.0 and motion[3] == 0.0
    n_changed = 0
    for env in range(start, stop):
        if changed(env, present, assigned):
            n_changed += 1
            continue
        x, y, c, s, _, _, _ = frame_state(env, t[env], frame, curve, motion)
        # The plan is ahead by the lookahead, which compensates the lag of the cars.
        ahead = frame_state(env, t[env] + lookahead, frame, curve, motion)
        _, _, c_a, s_a, v_x, v_y, turn = ahead
        for k in range(present.shape[1]):
            if not present[env, k]:
                goal[env, k, 0] = goal[env, k, 1] = 0.0
                plan[env, k, 0] = plan[env, k, 1] = 0.0
                continue
            o_x, o_y, informed = places[env, k, 0], places[env, k, 1], places[env, k, 2]
            goal[env, k, 0] = x + c * o_x - s * o_y
            goal[env, k, 1] = y + s * o_x + c * o_y
            reference_x = v_x - turn * (s_a * o_x + c_a * o_y)
            reference_y = v_y + turn * (c_a * o_x - s_a * o_y)
            plan[env, k, 0], plan[env, k, 1] = informed * reference_x, informed * reference_y
            # Cars without the plan have the velocity term too.
            velocity_term(env, k, vel, reference_x, reference_y, rewards)
        if place_scale > 0.0:
            place_term(env, pos, present, goal, place_scale, rewards)
        targets_from_goals(env, present, goal, target)
        formation_error(env, pos, present, target, error)
        arrived = ends and frame[env, 2] + motion[0] * t[env] >= motion[2]
        done[env] = arrived and all_within(env, pos, present, goal, tolerance)
        common_terms(env, accel, clear, present, collided, error, error_scale, rewards)
        if ends:
            time_term(env, present, done[env], rewards)
    return n_changed
