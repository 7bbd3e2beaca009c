"""Cars for the tests of the gate: bicycle models with motor, servo, link delay and deadman.

Parameters are those of a 1:10 car as in `relpos_env.world.car`; some are sampled per car. The cars
do not collide: the tests measure their distances.
"""

import numpy as np

DT = 0.01
FRONT, REAR = 0.144, 0.156
MAX_STEERING, STEERING_RATE, STEERING_DELAY = 0.42, 3.2, 2
SPEED_GAIN, MOTOR_LAG, MAX_ACCEL = 8.0, 0.05, 2.5
DEADMAN = 0.2
KEPT = 8
"""[ticks] Length of the buffer of commands in transit."""


class Cars:
    """Arrays over (env, car); `pos` (env, car, 2) is the position of the centre."""

    def __init__(self, pos, heading, rng):
        shape = heading.shape
        self.pos, self.heading = pos.copy(), heading.copy()
        self.speed, self.accel, self.steering = np.zeros((3, *shape))
        self.brake = rng.uniform(2.0, 2.5, shape)
        self.latency = rng.integers(1, 4, shape)
        self._wire = np.zeros((KEPT, 3, *shape))
        self._got = np.zeros((3, *shape))
        self._quiet = np.zeros(shape)
        self._tick = 0
        self._at = np.indices(shape)

    @property
    def ahead(self):
        return np.stack([np.cos(self.heading), np.sin(self.heading)], axis=-1)

    @property
    def slip(self):
        """Slip angle of the centre, relative to the heading [rad]."""
        return np.arctan(REAR / (FRONT + REAR) * np.tan(self.steering))

    @property
    def vel(self):
        course = self.heading + self.slip
        along = self.speed / np.cos(self.slip)
        return along[..., None] * np.stack([np.cos(course), np.sin(course)], axis=-1)

    def step(self, speed, steering, moving, linked):
        """Simulate one tick with the output of the gate; unlinked cars receive nothing."""
        self._wire[self._tick % KEPT] = speed, steering, moving
        late = (self._tick - self.latency) % KEPT
        ago = (late - STEERING_DELAY) % KEPT
        arrived = self._wire[late, :, self._at[0], self._at[1]].transpose(2, 0, 1)
        self._got = np.where(linked, arrived, self._got)
        self._got[1] = np.where(linked, self._wire[ago, 1, self._at[0], self._at[1]], self._got[1])
        self._quiet = np.where(linked, 0.0, self._quiet + DT)
        self._tick += 1
        requested, angle, drives = self._got
        drives = (drives == 1.0) & (self._quiet < DEADMAN)
        turn = STEERING_RATE * DT
        self.steering += np.clip(angle - self.steering, -turn, turn)
        v = self.speed
        asked = SPEED_GAIN * (np.where(drives, requested, 0.0) - v)
        # Brake against the motion, drive with the motor along it; a stop is full braking.
        ahead = np.where(v != 0.0, np.sign(v), np.sign(asked))
        driven = np.clip(asked * ahead, -self.brake, MAX_ACCEL) * ahead
        asked = np.where(drives, driven, -np.sign(v) * self.brake)
        self.accel += (asked - self.accel) * DT / MOTOR_LAG
        faster = v + self.accel * DT
        stops = ~drives & (faster * v <= 0.0)
        self.speed = np.where(stops, 0.0, faster)
        self.accel = np.where(stops, 0.0, self.accel)
        self.pos += self.vel * DT
        self.heading += self.speed * np.tan(self.steering) / (FRONT + REAR) * DT
