"""Mount of a tracker on its vehicle: relative to the axle that cannot slip sideways, and height."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from tracking.errors import ConfigError
from tracking.vehicles import VehicleParams

FARTHEST = 10.0
"""[m] Largest offset of a tracker on its vehicle."""
KEYS = {
    "ahead_m": "ahead",
    "aside_m": "aside",
    "wheelbase_m": "wheelbase",
    "slip_s2_per_m": "slip",
    "height_m": "height",
}
"""Keys of a table ``[nodes.ID.mount]`` in meta.toml or swarm.toml, and their fields."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Position of the tracker and slip of the vehicle; None for values that are estimated."""

    ahead: float | None = None
    """[m] Distance of the tracker ahead of the axle that does not steer; negative behind it."""
    aside: float = 0.0
    """[m] Distance of the tracker left of the vehicle's centre line; negative to the right."""
    wheelbase: float | None = None
    """[m] Distance between the axles. An unknown `ahead` is expected between them."""
    slip: float | None = None
    """[s2/m] Outward drift speed of that axle in a curve, per squared speed and yaw rate: the
    inverse of its cornering stiffness per load [1/rad] times gravity. 0 for tyres without slip."""
    height: float = 0.0
    """[m] Height above the plane that a planar group moves in, of static nodes as well: ranges
    between nodes of different heights are longer than distances in the plane. In space heights are
    estimated, and this is not used."""

    def check(self, where: str) -> None:
        """Check the ranges of all fields.

        Raises:
            ConfigError: A field is out of range.
        """
        for name in (f.name for f in fields(self)):
            value = getattr(self, name)
            low = 0.0 if name in ("wheelbase", "slip") else -FARTHEST
            high = 1.0 if name == "slip" else FARTHEST
            if value is not None and not (math.isfinite(value) and low <= value <= high):
                raise ConfigError(f"{where}.{name}: expected {low:g} to {high:g}, got {value!r}")

    @property
    def table(self) -> dict[str, float]:
        """The values that are not estimated, by their keys in a file."""
        given = ((key, getattr(self, name)) for key, name in KEYS.items())
        return {key: float(value) for key, value in given if value is not None}

    def prior(self, vehicle: VehicleParams) -> tuple[float, float, float, float]:
        """Return mean and std of `ahead` [m], then of `slip` [s2/m]; std 0 for known values."""
        ahead, ahead_std = vehicle.ahead, vehicle.ahead_std
        if self.wheelbase is not None:
            ahead, ahead_std = 0.5 * self.wheelbase, 0.5 * self.wheelbase
        slip, slip_std = vehicle.slip, vehicle.slip_std
        if self.ahead is not None:
            ahead, ahead_std = self.ahead, 0.0
        if self.slip is not None:
            slip, slip_std = self.slip, 0.0
        return ahead, ahead_std, slip, slip_std
