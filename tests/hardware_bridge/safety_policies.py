"""Adversarial policies: towards the fence, towards each other, and random commands."""

import numpy as np

FULL = 3.0
NAMES = (
    "chase", "fence", "swerve", "reverse", "random", "straight", "circle", "weave",
)  # fmt: skip


class Policies:
    """One policy for every car, sampled every few seconds; speed and steering, (env, car)."""

    def __init__(self, shape, rng):
        self._rng, self._shape = rng, shape
        self._kind = rng.integers(0, len(NAMES), shape)
        self._prey = rng.integers(0, shape[1], shape)
        self._side = rng.choice([-1.0, 1.0], shape)
        self._count = 0

    def decide(self, pos, heading, present):
        rng, shape = self._rng, self._shape
        self._count += 1
        again = rng.random(shape) < 0.03
        self._kind = np.where(again, rng.integers(0, len(NAMES), shape), self._kind)
        self._prey = np.where(again, rng.integers(0, shape[1], shape), self._prey)
        self._side = np.where(again, rng.choice([-1.0, 1.0], shape), self._side)
        env = np.arange(shape[0])[:, None]
        chase = pos[env, self._prey] - pos
        bearing = np.arctan2(chase[..., 1], chase[..., 0]) - heading
        bearing = np.arctan2(np.sin(bearing), np.cos(bearing))
        behind = np.abs(bearing) > 0.5 * np.pi
        noise = rng.uniform(-1.0, 1.0, (2, *shape))
        flip = np.where((self._count // 5) % 2 == 0, 1.0, -1.0)
        full, lock = np.full(shape, FULL), 0.42 * self._side
        to_prey = np.clip(2.0 * bearing, -0.42, 0.42)
        choices = {
            # Forwards or backwards, whichever is nearer.
            "chase": (
                np.where(behind & (self._side > 0), -FULL, FULL),
                np.where(behind & (self._side > 0), -0.42 * np.sign(bearing), to_prey),
            ),
            "fence": (full, 0.05 * noise[1]),
            "swerve": (full, np.where(noise[0] > 0.6, lock, 0.0)),
            "reverse": (-full, 0.42 * noise[1]),
            "random": (FULL * noise[0], 0.42 * noise[1]),
            "straight": (full * self._side, 0.0 * full),
            "circle": (full, lock),
            "weave": (full, lock * flip),
        }
        speed = np.stack([choices[name][0] for name in NAMES])
        steering = np.stack([choices[name][1] for name in NAMES])
        own = self._kind[None]
        return (
            np.take_along_axis(speed, own, axis=0)[0],
            np.take_along_axis(steering, own, axis=0)[0],
        )
