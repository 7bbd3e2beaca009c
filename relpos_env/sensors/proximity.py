"""Distance sensors around a car: ranges to walls, boxes and cars, independent of radios.

`relpos_env.interface.rangefinders` defines their positions and directions. The field of view of a
sensor is a cone; a reading is the distance from its tip to the nearest surface in the cone.

References:
    [1] ST, VL53L1X time-of-flight ranging sensor, datasheet DocID031281 Rev 3, 2018: up to 4 m,
        field of view 27 degrees, up to 50 Hz, accuracy some 2 cm.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

from relpos_env.interface.rangefinders import FARTHEST
from relpos_env.world.parameter_records import fill_numbers, numbers_dtype


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximitySimParams:
    """Parameters of the simulated distance sensors."""

    max_range: float = FARTHEST
    """[m] Reading without an object in range; the range is 4 m in the dark [1], less in light."""
    cone: float = radians(27.0)
    """[rad] Full angle of the cone [1]. A wider cone misses less but locates less precisely."""
    noise_std: float = 0.02
    """[m] Standard deviation of a reading at distance 0, drawn at each control step [1]."""
    noise_share: float = 0.01
    """[-] Increase of the standard deviation per metre of distance; assumed."""


PROXIMITY = numbers_dtype(ProximitySimParams, ("cone_cos", "cone_sin"))
"""Record type of `ProximitySimParams` for the kernels."""


def fill_proximity(record: Any, params: ProximitySimParams) -> None:
    """Write parameters into a record for the kernels."""
    fill_numbers(record, params)
    record["cone_cos"], record["cone_sin"] = cos(0.5 * params.cone), sin(0.5 * params.cone)
