"""Magnetometer on a car or a body: the earth's field, disturbed by the building.

The disturbance is a smooth field fixed in the room: a few waves with lengths of a few metres,
as caused by steel in floors and walls. It is the same at every height. Real disturbances are
largest near the floor, so a person's knees would measure more of them than the arms. Noise,
range and resolution are those of the LIS3MDL [1].

References:
    [1] STMicroelectronics, LIS3MDL data sheet DS9463.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from relpos_env.sensors.imu import quantise
from relpos_env.world.parameter_records import fill_numbers, numbers_dtype
from tracking.arrays import F64
from tracking.geometry import quat_conjugate, rotate


@dataclass(frozen=True, slots=True, kw_only=True)
class MagSimParams:
    """Parameters of the simulated magnetometer and of the magnetic field around it."""

    field_w: tuple[float, float, float] = (0.0, 20.0, -43.0)
    """[uT] Earth's magnetic field in central Europe: x east, y north, z up."""
    disturbance: float = 2.0
    """[uT] Standard deviation of one axis of the building's field."""
    wavelength: float = 4.0
    """[m] Length scale of the building's field; its waves are 0.6 to 1.6 times as long."""
    n_waves: int = 6
    """[-] Number of waves of the building's field."""
    hard_iron: float = 0.3
    """[uT] Standard deviation of the offset of one axis after calibration."""
    noise: float = 0.35
    """[uT] White noise of one axis, 3.2 to 4.1 mgauss."""
    full_scale: float = 800.0
    """[uT] Full scale, 8 gauss."""
    bits: int = 16
    """[-] Bits of the converter over the range; 0 disables rounding."""


MAG = numbers_dtype(MagSimParams, ("field_x", "field_y", "field_z", "resolution"))
"""Record type of `MagSimParams` for the kernels."""


def fill_mag(record: Any, params: MagSimParams) -> None:
    """Write parameters into the MAG record of one environment for the kernels."""
    fill_numbers(record, params)
    for name, value in zip("xyz", params.field_w, strict=True):
        record[f"field_{name}"] = value
    record["resolution"] = params.full_scale / 2.0 ** (params.bits - 1) if params.bits else 0.0


class Magnetometer:
    """Magnetometers of all nodes in one room, with the properties of `Imu`."""

    def __init__(self, params: MagSimParams, n_nodes: int, rng: np.random.Generator) -> None:
        self._params = p = params
        self._rng = rng
        angle = rng.uniform(0.0, 2.0 * np.pi, p.n_waves)
        length = p.wavelength * rng.uniform(0.6, 1.6, p.n_waves)
        self._wave = 2.0 * np.pi / length * np.stack([np.cos(angle), np.sin(angle)])
        self._phase = rng.uniform(0.0, 2.0 * np.pi, p.n_waves)
        scale = p.disturbance * np.sqrt(2.0 / max(p.n_waves, 1))
        self._amplitude = scale * rng.standard_normal((p.n_waves, 3))
        self._hard_iron = p.hard_iron * rng.standard_normal((n_nodes, 3))

    def field(self, pos_w: F64) -> F64:
        """Return the field in the world frame at points of the plane, (point, 3) [uT]."""
        waves = np.cos(pos_w @ self._wave + self._phase)
        field: F64 = np.array(self._params.field_w) + waves @ self._amplitude
        return field

    def sample_3d(self, pos_w: F64, q_wb: F64) -> F64:
        """Return one reading of every node in 3D, in its body frame.

        Args:
            pos_w: Positions, (node, 3) [m].
            q_wb: Orientation, body to world, (node, 4).

        Returns:
            Magnetic field, (node, 3) [uT].
        """
        return self._read(rotate(quat_conjugate(q_wb), self.field(pos_w[:, :2])))

    def _read(self, body: F64) -> F64:
        noise = self._params.noise * self._rng.standard_normal(body.shape)
        return quantise(body + self._hard_iron + noise, self._params.full_scale, self._params.bits)
