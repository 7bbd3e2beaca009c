"""Forces on cars, compiled: motor, brake and tyres."""

from __future__ import annotations

import numpy as np

from tracking.compiled import kernel

GRAVITY = 9.81


@kernel
def steer(steering, command, max_steering, rate, dt):
    """Move every servo towards its command, in place; (car) [rad]."""
    for n in range(steering.shape[0]):
        wanted = min(max(command[n], -max_steering), max_steering)
        steering[n] += min(max(wanted - steering[n], -rate * dt), rate * dt)


@kernel
def drive_forces(
    heading, vel, yaw_rate, steering, speed_command, mass, inertia, half_base, grip, motor, dt, out
):
    """Force and torque on every car for one step.

    Args:
        heading: (car) [rad].
        vel: World velocity, (car, 2) [m/s].
        yaw_rate: (car) [rad/s].
        steering: (car) [rad].
        speed_command: (car) [m/s].
        mass: [kg].
        inertia: [kg m2].
        half_base: Half the wheelbase [m].
        grip: Tyre friction [-].
        motor: Speed gain [1/s], largest acceleration [m/s2], largest speed [m/s].
        dt: Step [s].
        out: Force x, y [N] and torque [N m] in the world frame, (car, 3), written.
    """
    gain, max_accel, max_speed = motor
    limit = grip * mass * GRAVITY * 0.5 * dt
    for n in range(heading.shape[0]):
        c, s = np.cos(heading[n]), np.sin(heading[n])
        forward = c * vel[n, 0] + s * vel[n, 1]
        wanted = min(max(speed_command[n], -max_speed), max_speed)
        accel = min(max(gain * (wanted - forward), -max_accel), max_accel)
        # Body frame after the motor has pushed: forward, left, yaw rate.
        v_x = forward + accel * dt
        v_y = -s * vel[n, 0] + c * vel[n, 1]
        w = yaw_rate[n]
        cd, sd = np.cos(steering[n]), np.sin(steering[n])
        # Sideways velocity of the rear axle (at -b) and of the front axle (at b, turned).
        b = half_base
        slip_rear = v_y - b * w
        slip_front = -sd * v_x + cd * (v_y + b * w)
        # K maps the two sideways impulses to the change of the two slips.
        k_rr = 1.0 / mass + b * b / inertia
        k_rf = cd / mass - b * b * cd / inertia
        k_ff = 1.0 / mass + (b * cd) * (b * cd) / inertia
        det = k_rr * k_ff - k_rf * k_rf
        j_rear = -(k_ff * slip_rear - k_rf * slip_front) / det
        j_front = -(k_rr * slip_front - k_rf * slip_rear) / det
        j_rear = min(max(j_rear, -limit), limit)
        j_front = min(max(j_front, -limit), limit)
        f_x = mass * accel - sd * j_front / dt
        f_y = (j_rear + cd * j_front) / dt
        out[n, 0] = c * f_x - s * f_y
        out[n, 1] = s * f_x + c * f_y
        out[n, 2] = (-b * j_rear + b * cd * j_front) / dt
