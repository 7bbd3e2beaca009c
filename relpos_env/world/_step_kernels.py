"""One control period of every environment, step by step: cars, sensors and radios.

Cars move in a space of pymunk. With `physics="fast"` the space makes only the steps in which
bodies touch, or nearly. An environment waits if compiled code cannot step its space: the space
must be built, or other code has access to it.
"""

from __future__ import annotations

import math

from relpos_env.geometry._broad_phase_kernels import touches_soon
from relpos_env.sensors._imu_kernels import felt_on_car, read_imu
from relpos_env.sensors._magnetometer_kernels import read_magnetometer
from relpos_env.sensors.radio._membership_kernels import note_members
from relpos_env.sensors.radio._radio_kernels import run_env_window
from relpos_env.timing import SOON
from relpos_env.world._car_kernels import (
    PITCH,
    PITCH_RATE,
    ROLL,
    ROLL_RATE,
    drive_car,
    integrate_car,
)
from relpos_env.world._contact_kernels import solve
from tracking.kernels.jit import kernel, small_kernel
from tracking.maths.elementary import cosine_sine

MAG, IMU, RANGE = 1, 2, 5
WAITS, PUSHED, MOVED = 0, 1, 2
"""Stages of the current step: not started, forces computed, bodies moved."""
CALM = 5
"""[-] Steps for which the solver stays in use after the last contact: it remembers contacts for
three."""


@kernel
def begin_decision(bodies, events, t, next_life, speed, steering):
    """Clear the results of the last control period and the commands of absent cars.

    Args:
        bodies: Bodies, updated.
        events: Events, updated.
        t: Current time, (env) [s].
        next_life: Time of the next event of a car or tracker, (env) [s].
        speed: Commanded speeds, (env, car) [m/s], updated.
        steering: Commanded steering angles, (env, car) [rad], updated.

    Returns:
        Number of environments with a due event.
    """
    n_due = 0
    for e in range(bodies.done.shape[0]):
        bodies.done[e] = 0
        events.used[e] = 0
        n_due += next_life[e] <= t[e] + SOON
        for k in range(events.valid.shape[1]):
            events.valid[e, k] = False
        for n in range(bodies.contacts.shape[1]):
            bodies.contacts[e, n] = 0.0
            if not bodies.present[e, n]:
                speed[e, n] = steering[e, n] = 0.0
    return n_due


@kernel
def run_steps(
    bodies, solver, sensors, radio, members, scenes, n_steps, dt, events, speed, steering, t,
    waiting,
):  # fmt: skip
    """Step every environment until its control period is over or it must wait.

    Args:
        bodies: Bodies, updated.
        solver: Solver, updated.
        sensors: Sensors, updated.
        radio: SessionNumbers, RadioNumbers, Air, RangeBuffer and Overheard; updated.
        members: Membership state of each node, (env, node, 2), see `note_members`.
        scenes: Scene of all environments.
        n_steps: Steps of a control period.
        dt: Step [s].
        events: Events, appended.
        speed: Commanded speeds, (env, car) [m/s].
        steering: Commanded steering angles, (env, car) [rad].
        t: Time since each environment began, (env) [s], written.
        waiting: Indices of the environments that wait for `RoomState.move`, written.

    Returns:
        Number of waiting environments.
    """
    n_waiting = 0
    for e in range(bodies.done.shape[0]):
        while bodies.done[e] < n_steps:
            if bodies.stage[e] == WAITS:
                push_cars(bodies, speed, steering, dt, e)
                near = touches_soon(
                    bodies.body, bodies.present, bodies.box_body, bodies.boxes, bodies.room,
                    bodies.size, e,
                )  # fmt: skip
                bodies.calm[e] = CALM if near else max(bodies.calm[e] - 1, 0)
                bodies.stage[e] = PUSHED
            if bodies.stage[e] == MOVED:
                pass
            elif bodies.calm[e] > 0 or not bodies.fast[e]:
                if solver.calls[e].ready != bodies.tick[e]:
                    waiting[n_waiting] = e
                    n_waiting += 1
                    break
                solve(bodies, solver, e, dt)
            else:
                for n in range(bodies.body.shape[1]):
                    if bodies.present[e, n]:
                        integrate_car(bodies.cars[e], bodies.body, bodies.wrench, e, n, dt)
            bodies.stage[e] = WAITS
            bodies.tick[e] += 1
            sense(bodies, sensors, radio, members, scenes, dt, events, e)
            bodies.done[e] += 1
        t[e] = bodies.tick[e] * dt
    return n_waiting


@small_kernel
def push_cars(bodies, speed, steering, dt, e):
    """Compute forces on the cars; `accel` and `turn` keep velocity and heading until `sense`."""
    for n in range(bodies.body.shape[1]):
        if bodies.present[e, n]:
            drive_car(
                bodies.cars[e], bodies.body, bodies.drive, e, n, speed[e, n], steering[e, n], dt,
                bodies.wrench,
            )  # fmt: skip
        bodies.accel[e, n, 0] = bodies.body[e, n, 3]
        bodies.accel[e, n, 1] = bodies.body[e, n, 4]
        bodies.turn[e, n] = bodies.body[e, n, 2]


@small_kernel
def sense(bodies, sensors, radio, members, scenes, dt, events, e):
    """Append all measurements of the nodes of an environment after a step."""
    body, drive, accel, turn = bodies.body, bodies.drive, bodies.accel, bodies.turn
    tick, step = bodies.tick[e], bodies.done[e]
    t = tick * dt
    k = events.used[e]
    for n in range(body.shape[1]):
        accel[e, n, 0] = (body[e, n, 3] - accel[e, n, 0]) / dt
        accel[e, n, 1] = (body[e, n, 4] - accel[e, n, 1]) / dt
        turn[e, n] = (body[e, n, 2] - turn[e, n]) / dt
        spin_up = (turn[e, n] - bodies.turned[e, n]) / dt
        bodies.turned[e, n] = turn[e, n]
        heading, roll, pitch = body[e, n, 2], drive[e, n, ROLL], drive[e, n, PITCH]
        level = (math.cos(heading), math.sin(heading))
        ahead, aside = sensors.mount[e, n, 0], sensors.mount[e, n, 1]
        x = body[e, n, 0] + level[0] * ahead - level[1] * aside
        y = body[e, n, 1] + level[1] * ahead + level[0] * aside
        events.pose[e, step, n, 0] = x
        events.pose[e, step, n, 1] = y
        events.pose[e, step, n, 2] = heading
        events.pose[e, step, n, 3] = roll
        events.pose[e, step, n, 4] = pitch
        roll, pitch = cosine_sine(roll), cosine_sine(pitch)
        place_antenna(sensors, scenes, (x, y), level, roll, pitch, e, n)
        if not bodies.powered[e, n] or k + 2 > events.t.shape[1]:
            continue
        c, s = level
        forward = c * accel[e, n, 0] + s * accel[e, n, 1]
        left = c * accel[e, n, 1] - s * accel[e, n, 0]
        # Lever arm from the centre of mass to the tracker.
        forward -= turn[e, n] * turn[e, n] * ahead + spin_up * aside
        left += spin_up * ahead - turn[e, n] * turn[e, n] * aside
        truth = felt_on_car(
            turn[e, n], forward, left, roll, pitch, drive[e, n, ROLL_RATE], drive[e, n, PITCH_RATE],
        )  # fmt: skip
        velocity = c * body[e, n, 3] + s * body[e, n, 4]
        read_magnetometer(
            sensors.mag[e], sensors.mag_seed[e], tick, sensors.waves, sensors.hard_iron, e, n,
            (x, y), level, roll, pitch, events.values, k,
        )  # fmt: skip
        write_own(events, e, k, t, MAG, n)
        read_imu(
            sensors.imu[e], sensors.imu_seed[e], tick, sensors.bias, sensors.drift, e, n, truth,
            velocity, events.values, k + 1,
        )  # fmt: skip
        write_own(events, e, k + 1, t, IMU, n)
        k += 2
    numbers, radio_numbers, air, ranges, overheard = radio
    run_env_window(numbers, radio_numbers, air, scenes, dt, ranges, overheard, e)
    for r in range(ranges.used[e]):
        if k >= events.t.shape[1]:
            break
        events.t[e, k] = t - dt + ranges.t[e, r]
        events.kind[e, k] = RANGE
        i, j = ranges.i[e, r], ranges.j[e, r]
        events.i[e, k], events.j[e, k] = i, j
        events.antenna_i[e, k], events.antenna_j[e, k] = i, j
        events.values[e, k, 0] = ranges.values[e, r, 0]
        events.values[e, k, 1] = ranges.values[e, r, 1]
        events.values[e, k, 2] = ranges.values[e, r, 2]
        for column in range(3, events.values.shape[2]):
            events.values[e, k, column] = 0.0
        events.has_power[e, k], events.valid[e, k] = True, True
        events.nlos[e, k] = ranges.nlos[e, r]
        k += 1
    events.used[e] = note_members(air, members, t, events, e, k)


@small_kernel
def write_own(events, e, k, t, kind, n):
    """Write an event of one node, except for its values."""
    events.t[e, k], events.kind[e, k] = t, kind
    events.i[e, k], events.j[e, k] = n, n
    events.antenna_i[e, k], events.antenna_j[e, k] = 0, 0
    for column in range(3 if kind == MAG else 6, events.values.shape[2]):
        events.values[e, k, column] = 0.0
    events.has_power[e, k], events.nlos[e, k], events.valid[e, k] = False, False, True


@small_kernel
def place_antenna(sensors, scenes, at, heading, roll, pitch, e, n):
    """Update the previous and the current position of a car's antenna on its mast.

    The angles are pairs of cosine and sine, `at` is the position of the tracker [m].
    """
    before, now, h = scenes.pos0, scenes.pos1, sensors.mast[e] + sensors.mount[e, n, 2]
    for a in range(3):
        before[e, n, a] = now[e, n, a]
    c, s = heading
    cr, sr = roll
    cp, sp = pitch
    ahead, left = h * sp * cr, -h * sr
    now[e, n, 0] = at[0] + c * ahead - s * left
    now[e, n, 1] = at[1] + s * ahead + c * left
    now[e, n, 2] = h * cp * cr
