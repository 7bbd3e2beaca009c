"""Checks of the options of tasks; errors name the option."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from relpos_env.errors import EnvError
from tracking.arrays import F64


def positive(name: str, value: float) -> float:
    """Return the value, checked to be finite and more than 0.

    Raises:
        EnvError: The value is out of range.
    """
    return _number(name, value, "a finite number more than 0", low=0.0, strict=True)


def not_negative(name: str, value: float) -> float:
    """Return the value, checked to be finite and at least 0.

    Raises:
        EnvError: The value is out of range.
    """
    return _number(name, value, "a finite number of at least 0", low=0.0, strict=False)


def share(name: str, value: float) -> float:
    """Return the value, checked to be more than 0 and at most 1.

    Raises:
        EnvError: The value is out of range.
    """
    number = positive(name, value)
    if number > 1.0:
        raise EnvError(f"{name}: expected a share of at most 1, got {value!r}")
    return number


def finite(name: str, value: float) -> float:
    """Return the value, checked to be finite.

    Raises:
        EnvError: The value is not a finite number.
    """
    return _number(name, value, "a finite number", low=-np.inf, strict=False)


def flag(name: str, value: bool) -> bool:
    """Return the value, checked to be True or False.

    Raises:
        EnvError: The value is not a bool.
    """
    if not isinstance(value, bool):
        raise EnvError(f"{name}: expected True or False, got {value!r}")
    return value


def car_count(n_cars: int) -> int:
    """Return the maximum number of cars, checked to be 2 to 20.

    Raises:
        EnvError: The number is out of range.
    """
    if not 2 <= n_cars <= 20:
        raise EnvError(f"n_cars: expected 2 to 20, got {n_cars}")
    return n_cars


def half_room(room: Sequence[float], margin: float) -> F64:
    """Return the half axes of the room less a margin to the walls, (2) [m].

    Raises:
        EnvError: The room is not a pair of lengths, or not larger than the margins.
    """
    size = points("room", [room], 1)[0]
    if size.min() <= 2.0 * margin:
        raise EnvError(f"room: expected more than {2.0 * margin:g} m each way, got {room!r}")
    half: F64 = 0.5 * size - margin
    return half


def points(name: str, value: Sequence[Sequence[float]] | F64, at_least: int) -> F64:
    """Return points in the plane as an array, (point, 2) [m].

    Raises:
        EnvError: The value is not a list of finite points, or has too few.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise EnvError(f"{name}: expected points (x, y) [m], finite, got {value!r}")
    if len(array) < at_least:
        raise EnvError(f"{name}: expected at least {at_least} points, got {len(array)}")
    return array


def _number(name: str, value: float, expected: str, *, low: float, strict: bool) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number) or number < low or (strict and number <= low):
        raise EnvError(f"{name}: expected {expected}, got {value!r}")
    return number
