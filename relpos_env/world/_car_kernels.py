"""Compiled dynamic bicycle: servo, motor, tyres, roll and pitch of one car and of many.

Derived in docs/reference/vehicle.md. In the frame of the car (x forward, y left), with the wheels'
rolling velocities u and side slips s at the rear and the front axle,

    m (v_x' - r v_y) = F_xr + F_xf cos d - F_yf sin d
    m (v_y' + r v_x) = F_yr + F_xf sin d + F_yf cos d
    I r'             = l_f (F_xf sin d + F_yf cos d) - l_r F_yr
    F_y = -sign(s) Y (1 - (1 - z)^3),   z = min(1, C |s| / (3 Y |u|)),   Y^2 + F_x^2 = (mu N)^2

which is the brush tyre of [1] inside the friction ellipse. A force against a slip is at most
the force that stops this slip within the step, given the inverse masses that couple the axles.
Tyres therefore only dissipate energy, for any step, and hold at standstill.

References:
    [1] Pacejka, Tire and Vehicle Dynamics, 3rd ed., Butterworth-Heinemann 2012, section 3.2.
"""

from __future__ import annotations

import math

from tracking.kernels.jit import kernel, small_kernel

X, Y, HEADING, VX, VY, RATE = range(6)
"""Columns of a body: [m], [m], [rad], world velocity [m/s], [m/s], yaw rate [rad/s]."""
STEERING, ACCEL, ROLL, ROLL_RATE, ROLL_ACCEL, PITCH, PITCH_RATE, PITCH_ACCEL = range(8)
"""Columns of a drive: front wheels [rad], motor [m/s2], then angles [rad] and their derivatives."""
TURN, PAST = 8, 9
"""Columns of a drive: index of the next steering command in its ring buffer, and the buffer."""
N_PAST = 16
"""[-] Steering commands in the ring buffer; the delay in steps must be shorter."""
N_DRIVE = PAST + N_PAST
"""[-] Columns of a drive; all zero is a car at rest."""
SETTLED = 1e-12
"""[m/s2, m/s, rad/s] Motors and bodies below this are set to rest; avoids denormal numbers."""


@small_kernel
def drive_car(p, body, drive, e, n, speed, steering, dt, wrench):
    """Advance the drive of one car and write the force and torque on it for the next step.

    Args:
        p: Car, a record of `relpos_env.world.car.CAR`.
        body: (env, car, 6), read.
        drive: (env, car, `N_DRIVE`), advanced.
        e: Index of the environment.
        n: Index of the car.
        speed: Commanded speed, backwards if negative [m/s].
        steering: Commanded steering angle, left is positive [rad].
        dt: Step, equal to that of the record [s].
        wrench: Force x, y [N] in the world frame, torque [N m], (env, car, 3), written.
    """
    c, s = math.cos(body[e, n, HEADING]), math.sin(body[e, n, HEADING])
    v_x = c * body[e, n, VX] + s * body[e, n, VY]
    v_y = c * body[e, n, VY] - s * body[e, n, VX]
    rate = body[e, n, RATE]

    angle = _steer(p, drive, e, n, steering, dt)
    commanded = _clip(speed, p.max_speed)
    motor = _motor(p, drive[e, n, ACCEL], commanded, v_x)
    drive[e, n, STEERING] = angle
    drive[e, n, ACCEL] = motor

    pushes = motor * commanded > 0.0
    if pushes or abs(v_x) + abs(v_y) + abs(rate) > SETTLED:
        f_x, f_y, torque = _tyres(p, v_x, v_y, rate, angle, motor, pushes, dt)
        wrench[e, n, 0] = c * f_x - s * f_y
        wrench[e, n, 1] = s * f_x + c * f_y
        wrench[e, n, 2] = torque
    else:
        f_x, f_y = 0.0, 0.0
        wrench[e, n, 0] = -body[e, n, VX] * p.mass / dt
        wrench[e, n, 1] = -body[e, n, VY] * p.mass / dt
        wrench[e, n, 2] = -rate * p.inertia / dt

    # The body rolls outwards in a turn (to the right in a left turn) and dives when braking.
    roll, dive = p.roll_per_force * f_y, -p.pitch_per_force * f_x
    _sway(drive, e, n, ROLL, roll, p.roll_stiffness, p.roll_damping, p.roll_slack, dt)
    _sway(drive, e, n, PITCH, dive, p.pitch_stiffness, p.pitch_damping, p.pitch_slack, dt)


@small_kernel
def integrate_car(p, body, wrench, e, n, dt):
    """Integrate a body without contacts as Chipmunk does: first the pose, then the velocity."""
    body[e, n, X] += body[e, n, VX] * dt
    body[e, n, Y] += body[e, n, VY] * dt
    body[e, n, HEADING] += body[e, n, RATE] * dt
    body[e, n, VX] += wrench[e, n, 0] * p.mass_inv * dt
    body[e, n, VY] += wrench[e, n, 1] * p.mass_inv * dt
    body[e, n, RATE] += wrench[e, n, 2] * p.inertia_inv * dt


@kernel
def drive_cars(cars, body, drive, present, command_speed, command_steering, dt, wrench):
    """Apply `drive_car` to all cars; the force on absent cars is 0.

    Args:
        cars: Records of `relpos_env.world.car.CAR`, (env).
        body: (env, car, 6).
        drive: (env, car, `N_DRIVE`), advanced.
        present: Mask of present cars, (env, car).
        command_speed: Commanded speeds, (env, car) [m/s].
        command_steering: Commanded steering angles, (env, car) [rad].
        dt: Step [s].
        wrench: (env, car, 3), written.
    """
    for e in range(body.shape[0]):
        p = cars[e]
        for n in range(body.shape[1]):
            if present[e, n]:
                speed, steering = command_speed[e, n], command_steering[e, n]
                drive_car(p, body, drive, e, n, speed, steering, dt, wrench)
            else:
                wrench[e, n, 0] = wrench[e, n, 1] = wrench[e, n, 2] = 0.0


@kernel
def integrate_cars(cars, body, present, wrench, dt):
    """Apply `integrate_car` to all present cars; arguments as of `drive_cars`."""
    for e in range(body.shape[0]):
        p = cars[e]
        for n in range(body.shape[1]):
            if present[e, n]:
                integrate_car(p, body, wrench, e, n, dt)


@small_kernel
def _clip(value, limit):
    return min(max(value, -limit), limit)


@small_kernel
def _steer(p, drive, e, n, command, dt):
    """Return the angle of the front wheels after a step: the servo follows a delayed command."""
    turn = int(drive[e, n, TURN])
    drive[e, n, PAST + turn] = command
    then = (turn - int(p.delay_steps)) & (N_PAST - 1)
    drive[e, n, TURN] = (turn + 1) & (N_PAST - 1)
    angle = drive[e, n, STEERING]
    commanded = _clip(drive[e, n, PAST + then], p.max_steering)
    return angle + _clip(commanded - angle, p.steering_rate * dt)


@small_kernel
def _motor(p, motor, commanded, v_x):
    """Return the motor acceleration after a step: a speed controller with a lag [m/s2]."""
    asked = p.speed_gain * (commanded - v_x)
    if commanded != 0.0:
        asked += math.copysign(p.rolling, commanded)
    asked = _clip(asked, p.max_brake if asked * v_x < 0.0 else p.max_accel)
    motor = asked + p.motor_keep * (motor - asked)
    return motor if abs(motor) > SETTLED else 0.0


@small_kernel
def _tyres(p, v_x, v_y, rate, angle, motor, pushes, dt):
    """Return forward and left force [N] and torque [N m] of the tyres of both axles on the car."""
    sd = math.sin(angle)
    cd = math.sqrt(1.0 - sd * sd)
    hub = v_y + p.front * rate
    u_front, s_front = cd * v_x + sd * hub, cd * hub - sd * v_x
    s_rear = v_y - p.rear * rate

    # Change of a slip per force against it: row sums of J M^-1 J' along and across the wheels,
    # times dt. Forces up to slip / row sum dissipate energy.
    cross = abs(cd * (p.mass_inv - p.front * p.rear * p.inertia_inv))
    lever = p.front * cd
    across_rear = dt * (p.mass_inv + p.rear * p.rear * p.inertia_inv + cross)
    across_front = dt * (p.mass_inv + lever * lever * p.inertia_inv + cross)
    lever = p.front * sd
    along_rear = dt * (1.0 + cd) * p.mass_inv
    along_front = along_rear + dt * lever * lever * p.inertia_inv

    force, share, drag = motor * p.mass, p.front_drive, p.rolling_share
    grip_rear, grip_front = p.friction * p.rear_load, p.friction * p.front_load
    fx_rear = _along(v_x, force * (1.0 - share), pushes, drag * p.rear_load, grip_rear, along_rear)
    fx_front = _along(u_front, force * share, pushes, drag * p.front_load, grip_front, along_front)
    fy_rear = _across(s_rear, v_x, fx_rear, grip_rear, p.rear_stiffness, across_rear)
    fy_front = _across(s_front, u_front, fx_front, grip_front, p.front_stiffness, across_front)

    side = sd * fx_front + cd * fy_front
    f_x = fx_rear + cd * fx_front - sd * fy_front
    return f_x, fy_rear + side, p.front * side - p.rear * fy_rear


@small_kernel
def _along(u, motor, pushes, drag, grip, yields):
    """Return the longitudinal force of an axle that rolls at u: motor, brake, resistance, grip [N].

    A motor that does not push towards the commanded speed is a brake: it never drives the wheels
    and holds them at rest. The force -u / yields stops the wheels within the step.
    """
    if not pushes:
        if motor * u > 0.0:
            motor = 0.0
        elif abs(motor) * yields > abs(u):
            motor = -u / yields
    free = u + motor * yields
    if abs(free) > drag * yields:
        return _clip(motor - math.copysign(drag, free), grip)
    return _clip(-u / yields, grip)


@small_kernel
def _across(s, u, along, grip, stiffness, yields):
    """Return the lateral force of an axle that slips at s while it rolls at u [N]."""
    room = math.sqrt(max(grip * grip - along * along, 0.0))
    slip, full = stiffness * abs(s), 3.0 * room * abs(u)
    force = room
    if slip < full:
        z = slip / full
        force = room * z * (3.0 - z * (3.0 - z))
    if force * yields > abs(s):
        force = abs(s) / yields
    return -math.copysign(force, s)


@small_kernel
def _sway(drive, e, n, column, rest, stiffness, damping, slack, dt):
    """Step a spring-damper towards its rest angle by the implicit midpoint rule.

    Stiffness is omega^2 [1/s2], damping 2 zeta omega [1/s], and slack the factor of the implicit
    step, 1 / (1 + damping dt / 2 + stiffness dt^2 / 4).
    """
    angle, rate = drive[e, n, column], drive[e, n, column + 1]
    h = 0.5 * dt
    accel = slack * (stiffness * (rest - angle - h * rate) - damping * rate)
    angle += dt * (rate + h * accel)
    rate += dt * accel
    if abs(angle) + abs(rate) + abs(accel) < SETTLED:
        angle, rate, accel = 0.0, 0.0, 0.0
    drive[e, n, column] = angle
    drive[e, n, column + 1] = rate
    drive[e, n, column + 2] = accel
