"""Snapshot of a group for the gate: requested commands, estimates and their uncertainty.

All values are arrays over (env, car, ...): a supervisor has one environment, tests have thousands.
A snapshot is sent between processes as the bytes of its arrays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tracking.arrays import F64


class Picture(NamedTuple):
    """Snapshot of a group; all float64, masks are 0 or 1. World frame."""

    t: F64
    """Time, by the host's monotonic clock, (env) [s]."""
    requested_speed: F64
    """Requested speed, (env, car) [m/s]."""
    requested_steering: F64
    """Requested steering angle, (env, car) [rad]."""
    present: F64
    """1 if the car takes part, (env, car)."""
    oriented: F64
    """1 if the heading is known, (env, car)."""
    heading: F64
    """Heading, (env, car) [rad]."""
    speed: F64
    """Forward speed, (env, car) [m/s]."""
    status: F64
    """`tracking.Status` of each pair, (env, car, other)."""
    sound: F64
    """1 if the covariance is finite, symmetric and positive definite, (env, car, other)."""
    sigma: F64
    """Largest standard deviation of the other's position, (env, car, other) [m]."""
    pos: F64
    """Position of the other relative to the car, (env, car, other, 2) [m]."""
    vel: F64
    """Velocity of the other relative to the car, (env, car, other, 2) [m/s]."""
    distance: F64
    """Last range as measured, (env, car, other) [m]."""
    ranged: F64
    """Time of the last range, (env, car, other) [s]; -inf before the first."""
    placed: F64
    """1 if the position in the fence is known, (env, car)."""
    place: F64
    """Position relative to the node of the fence, (env, car, 2) [m]."""
    place_sigma: F64
    """Largest standard deviation of `place`, (env, car) [m]."""

    def to_bytes(self) -> bytes:
        """Return the bytes of all arrays in order."""
        return b"".join(array.tobytes() for array in self)

    @classmethod
    def from_bytes(cls, data: bytes, n_cars: int) -> Picture:
        """Return the snapshot of one environment from its bytes.

        Raises:
            ValueError: The length is not that of a snapshot of `n_cars` cars.
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
    """Return a snapshot with no car present and none commanded to move."""
    own, pair = (n_envs, n_cars), (n_envs, n_cars, n_cars)
    z = np.zeros
    return Picture(
        t=np.full(n_envs, -np.inf),
        requested_speed=z(own),
        requested_steering=z(own),
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
    """Return the largest standard deviation in the plane; NaN if it is not defined.

    Args:
        cov: Covariance xx, yy, xy, (..., 3) [m2].

    Returns:
        Standard deviation, (...) [m].
    """
    xx, yy, xy = cov[..., 0], cov[..., 1], cov[..., 2]
    with np.errstate(invalid="ignore"):
        std: F64 = np.sqrt(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy))
    return std
