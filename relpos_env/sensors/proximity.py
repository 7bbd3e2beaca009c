"""Distance sensors round a car: walls, boxes and other cars, which no radio tells of.

Where beams stand is in `relpos_env.interface.beams`. A beam is a cone, and reads the distance from
its tip to the nearest surface in it.

References:
    [1] ST, VL53L1X time-of-flight ranging sensor, datasheet DocID031281 Rev 3, 2018: up to 4 m,
        field of view 27 degrees, up to 50 Hz, accuracy some 2 cm.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

from relpos_env.interface.beams import FARTHEST
from relpos_env.world.parameter_records import fill_numbers, numbers_dtype


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximitySimParams:
    """What the simulated distance sensors do."""

    max_range: float = FARTHEST
    """[m] What a beam reads that meets nothing; 4 m in the dark [1], less in light."""
    cone: float = radians(27.0)
    """[rad] Full angle of a beam [1]. Wider misses less and tells less where it is."""
    noise_std: float = 0.02
    """[m] Of a reading, new at each decision [1]."""
    noise_share: float = 0.01
    """[-] Its standard deviation grows by so much of the distance; assumed."""


PROXIMITY = numbers_dtype(ProximitySimParams, ("cone_cos", "cone_sin"))
"""`ProximitySimParams` as the kernels take it."""


def fill_proximity(record: Any, params: ProximitySimParams) -> None:
    """Copy parameters into a record."""
    fill_numbers(record, params)
    record["cone_cos"], record["cone_sin"] = cos(0.5 * params.cone), sin(0.5 * params.cone)
