"""Estimates of the cars: delayed, with errors that match their covariance, and with faults.

An error is a Gaussian process of time constant `MEMORY`, its norm limited to `WORST` standard
deviations; the covariance is that of the process. The position is a past one, dead-reckoned to the
current time by the velocity of that time.
"""

import numpy as np

from hardware_bridge.safety.picture import blank_picture
from tracking.estimate import Status

MEMORY, WORST, HEADING = 1.5, 2.5, 0.03


class Errors:
    """Position errors, (env, ..., 2) in standard deviations."""

    def __init__(self, shape, rng):
        self._rng = rng
        self._value = rng.standard_normal((*shape, 2))

    def step(self, dt, jump=False):
        keep = np.exp(-dt / MEMORY)
        new = self._rng.standard_normal(self._value.shape)
        self._value = keep * self._value + np.sqrt(1.0 - keep * keep) * new
        self._value = np.where(jump, new, self._value)
        size = np.linalg.norm(self._value, axis=-1, keepdims=True)
        return self._value * np.minimum(1.0, WORST / np.maximum(size, 1e-9))


class Estimates:
    """Generator of snapshots of cars."""

    def __init__(self, n_envs, n_cars, rng, sigma=(0.03, 0.3)):
        self._rng = rng
        own, pair = (n_envs, n_cars), (n_envs, n_cars, n_cars)
        self._pair, self._place = Errors(pair, rng), Errors(own, rng)
        low, high = np.log(sigma)
        self.sigma = np.exp(rng.uniform(low, high, (n_envs, 1, 1)))
        self.place_sigma = np.exp(rng.uniform(low, high, (n_envs, 1)))
        self.delay = rng.uniform(0.05, 0.12, n_envs)
        self._heading = Errors(own, rng)
        self._past = []

    def watch(self, cars, present):
        """Store the state of a tick."""
        self._past.append((cars.pos.copy(), cars.vel.copy()))
        del self._past[:-13]

    def picture(self, t, cars, present, dt, faults):
        """Return the current estimates; `faults` adds further errors."""
        n_envs, n_cars = present.shape
        lag = np.minimum(np.round(self.delay / 0.01).astype(int), len(self._past) - 1)
        env, jump = np.arange(n_envs), faults.jump[:, None, None]
        past_pos = np.stack([p for p, _ in self._past])[-1 - lag, env]
        past_vel = np.stack([v for _, v in self._past])[-1 - lag, env]
        pos = past_pos + (lag * 0.01)[:, None, None] * past_vel
        q = blank_picture(n_envs, n_cars)
        q.t[:] = t
        q.present[:] = present
        q.oriented[:] = 1.0
        heading = self._heading.step(dt)[..., 0] * HEADING
        q.heading[:] = cars.heading + heading
        q.speed[:] = cars.speed * 1.02
        both = present[:, :, None] & present[:, None, :] & ~np.eye(n_cars, dtype=bool)
        q.status[:] = np.where(both, Status.OK, Status.ABSENT)
        q.sound[:] = 1.0
        sigma = self.sigma * (1.0 + faults.growth[:, None, None])
        error = self._pair.step(dt, jump[..., None])
        error = (
            np.where(np.arange(n_cars)[:, None] < np.arange(n_cars), 1.0, 0.0)[..., None] * error
        )
        error = error - np.swapaxes(error, 1, 2)
        true = cars.pos[:, None, :] - cars.pos[:, :, None]
        q.pos[:] = pos[:, None, :] - pos[:, :, None] + sigma[..., None] * error
        q.vel[:] = past_vel[:, None, :] - past_vel[:, :, None]
        q.sigma[:] = sigma
        q.distance[:] = np.linalg.norm(true, axis=-1) + np.minimum(np.abs(error[..., 0]) * 0.1, 0.2)
        q.ranged[:] = t[:, None, None] - 0.05
        q.placed[:] = 1.0
        place_sigma = self.place_sigma * (1.0 + faults.growth[:, None])
        q.place[:] = pos + place_sigma[..., None] * self._place.step(dt, jump)
        q.place_sigma[:] = place_sigma
        hit = faults.hit(n_cars)
        q.sound[:] = np.where(faults.unsound[:, None, None] & hit, 0.0, q.sound)
        unsure = faults.ambiguous[:, None, None] & (hit | np.swapaxes(hit, 1, 2)) & both
        doubt = np.where(env % 2 == 0, Status.AMBIGUOUS, Status.DOUBTFUL)
        q.status[:] = np.where(unsure, doubt[:, None, None], q.status)
        # Unknown positions are meaningless values.
        q.pos[:] = np.where(unsure[..., None], self._rng.normal(0.0, 2.0, q.pos.shape), q.pos)
        return q
