"""What the gate is told of a group: wishes, whereabouts, and how far they can be trusted.

Plain numbers in arrays over (env, car, ...): a supervisor has one environment, tests have
thousands. A picture travels between processes as the bytes of its numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64


class Picture(NamedTuple):
    """One moment of a group; all float64, masks are 0 or 1. World frame."""

    t: F64
    """When, by the host's monotonic clock, (env) [s]."""
    speed_wanted: F64
    """(env, car) [m/s]"""
    steering_wanted: F64
    """(env, car) [rad]"""
    present: F64
    """Who takes part, (env, car)."""
    oriented: F64
    """Whose heading is known, (env, car)."""
    heading: F64
    """(env, car) [rad]"""
    speed: F64
    """Forward, (env, car) [m/s]."""
    status: F64
    """A `tracking.Status` of each pair, (env, car, other)."""
    sound: F64
    """Whether the covariance is one: finite, symmetric, positive definite, (env, car, other)."""
    sigma: F64
    """Largest standard deviation of where the other is, (env, car, other) [m]."""
    pos: F64
    """Of the other relative to the car, (env, car, other, 2) [m]."""
    vel: F64
    """(env, car, other, 2) [m/s]"""
    distance: F64
    """Last range as it came, (env, car, other) [m]."""
    ranged: F64
    """When that was, (env, car, other) [s]; -inf before the first."""
    placed: F64
    """Whether the place in the fence is known, (env, car)."""
    place: F64
    """Relative to the node of the fence, (env, car, 2) [m]."""
    place_sigma: F64
    """Largest standard deviation of that, (env, car) [m]."""

    def to_bytes(self) -> bytes:
        """All numbers one after the other."""
        return b"".join(array.tobytes() for array in self)

    @classmethod
    def from_bytes(cls, data: bytes, n_cars: int) -> Picture:
        """The picture of one environment that these are.

        Raises:
            ValueError: The length is not that of a picture of so many cars.
        """
        blank = blank_picture(1, n_cars)
        expected = sum(array.nbytes for array in blank)
        if len(data) != expected:
            raise ValueError(f"expected {expected} bytes, got {len(data)}")
        numbers = np.frombuffer(data, dtype=np.float64)
        parts, start = [], 0
        for array in blank:
            parts.append(numbers[start : start + array.size].reshape(array.shape))
            start += array.size
        return cls(*parts)


def blank_picture(n_envs: int, n_cars: int) -> Picture:
    """No car is there, and none is commanded to move."""
    own, pair = (n_envs, n_cars), (n_envs, n_cars, n_cars)
    z = np.zeros
    return Picture(
        t=np.full(n_envs, -np.inf),
        speed_wanted=z(own),
        steering_wanted=z(own),
        present=z(own),
        oriented=z(own),
        heading=z(own),
        speed=z(own),
        status=z(pair),
        sound=z(pair),
        sigma=z(pair),
        pos=z((*pair, 2)),
        vel=z((*pair, 2)),
        distance=z(pair),
        ranged=np.full(pair, -np.inf),
        placed=z(own),
        place=z((*own, 2)),
        place_sigma=z(own),
    )


def largest_std(cov: F64) -> F64:
    """Largest standard deviation in the plane; NaN where there is none.

    Args:
        cov: xx, yy, xy, (..., 3) [m2]

    Returns:
        (...) [m]
    """
    xx, yy, xy = cov[..., 0], cov[..., 1], cov[..., 2]
    with np.errstate(invalid="ignore"):
        std: F64 = np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
    return std
