"""Checks of parameters: finite numbers, above zero unless they may be zero."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields

from tracking.errors import ConfigError


def check_numbers(params: object, *, may_be_zero: Iterable[str] = ()) -> None:
    """Check every numeric field of a dataclass; other fields pass.

    Args:
        params: The dataclass.
        may_be_zero: Fields that may be 0.

    Raises:
        ConfigError: A number is not finite, is negative, or is 0 and may not be; it is named.
    """
    for f in fields(params):  # type: ignore[arg-type]
        value = getattr(params, f.name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        low = f.name in may_be_zero
        if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not low):
            allowed = "of 0 or more" if low else "above 0"
            raise ConfigError(f"{f.name}: expected a number {allowed}, got {value}")
