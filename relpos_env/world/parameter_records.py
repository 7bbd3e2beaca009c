"""Parameters of environments as records for the kernels."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Records = NDArray[Any]


def numbers_dtype(params: type, derived: tuple[str, ...] = ()) -> np.dtype[Any]:
    """Return a record type with a float for every plain number of a parameter class.

    Args:
        params: A dataclass; fields that are not annotated as float or int are left out.
        derived: Further names, which the caller fills.
    """
    plain = [f.name for f in fields(params) if f.type in ("float", "int")]
    return np.dtype([(name, "f8") for name in (*plain, *derived)])


def fill_numbers(record: Any, params: Any) -> None:
    """Copy every plain number of a parameter object into its record."""
    for f in fields(params):
        if f.name in record.dtype.names:
            record[f.name] = getattr(params, f.name)
