"""Six-axis IMU on a car or a body: gyroscope and accelerometer with their errors.

    reading = round(clip(truth + bias(t) + noise + vibration))

The bias is the residual of a calibration at rest: a constant and a slow first-order Markov
part. Noise, range and resolution are those of the LSM6DSOX [1]; vibration is that of a car on
a floor or of a strap on skin, white at the output rate and growing with speed.

References:
    [1] STMicroelectronics, LSM6DSOX data sheet DS12814.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from relpos_env.sensors._imu_kernels import DRIFT_EVERY
from relpos_env.world.parameter_records import fill_numbers, numbers_dtype
from tracking.arrays import F64
from tracking.geometry import GRAVITY, quat_conjugate, rotate


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuSimParams:
    """Parameters of the simulated IMU."""

    gyr_noise: float = 4.7e-4
    """[rad/s] White noise of an axis: 3.8 mdps/sqrt(Hz) in 50 Hz of bandwidth."""
    acc_noise: float = 5.0e-3
    """[m/s2] White noise of an axis: 70 ug/sqrt(Hz) in 50 Hz of bandwidth."""
    gyr_bias: float = 3.5e-3
    """[rad/s] Standard deviation of the constant bias after calibration, 0.2 deg/s."""
    acc_bias: float = 0.03
    """[m/s2] Standard deviation of the constant bias after calibration, 3 mg."""
    gyr_drift: float = 8.7e-4
    """[rad/s] Standard deviation of the slow bias, 0.05 deg/s."""
    acc_drift: float = 0.01
    """[m/s2] Standard deviation of the slow bias."""
    drift_tau: float = 100.0
    """[s] Time constant of the slow bias."""
    vibration: float = 0.35
    """[m/s2] Vibration noise of an accelerometer axis at `vibration_speed` and above."""
    gyr_vibration: float = 0.02
    """[rad/s] Vibration noise of a gyroscope axis at `vibration_speed` and above."""
    vibration_speed: float = 1.0
    """[m/s] Speed at which the vibration noise is full; it is proportional below."""
    gyr_range: float = 34.9
    """[rad/s] Full scale of the gyroscope, 2000 deg/s."""
    acc_range: float = 78.5
    """[m/s2] Full scale of the accelerometer, 8 g."""
    bits: int = 16
    """[-] Bits of the converter over the range; 0 disables rounding."""


HUMAN_IMU = ImuSimParams(vibration=0.5, gyr_vibration=0.05, vibration_speed=2.0)
"""IMU worn by a person: skin and straps vibrate after heel strikes and swings. The amplitude is
assumed: soft tissue moves by millimetres at 10 Hz to 20 Hz, of which 0.5 m/s2 is a small part."""


IMU = numbers_dtype(
    ImuSimParams, ("keep", "gyr_step", "acc_step", "gyr_resolution", "acc_resolution")
)
"""Record type of `ImuSimParams` for the kernels."""


def fill_imu(record: Any, params: ImuSimParams, dt: float) -> None:
    """Write parameters into a record for the kernels.

    Args:
        record: IMU of one environment, written.
        params: Parameters of its IMUs.
        dt: Time between two samples [s].
    """
    fill_numbers(record, params)
    keep = float(np.exp(-dt * DRIFT_EVERY / params.drift_tau))
    record["keep"] = keep
    record["gyr_step"] = np.sqrt(1.0 - keep**2) * params.gyr_drift
    record["acc_step"] = np.sqrt(1.0 - keep**2) * params.acc_drift
    steps = 2.0 ** (params.bits - 1)
    record["gyr_resolution"] = params.gyr_range / steps if params.bits else 0.0
    record["acc_resolution"] = params.acc_range / steps if params.bits else 0.0


class Imu:
    """IMUs of all nodes. Equal seeds give equal streams; without errors, readings are the truth."""

    def __init__(
        self, params: ImuSimParams, n_nodes: int, rng: np.random.Generator, dt: float = 0.01
    ) -> None:
        self._params = p = params
        self._rng = rng
        constant = np.repeat([p.gyr_bias, p.acc_bias], 3)
        self._drift_std = np.repeat([p.gyr_drift, p.acc_drift], 3)
        self._noise = np.repeat([p.gyr_noise, p.acc_noise], 3)
        self._vibration = np.repeat([p.gyr_vibration, p.vibration], 3)
        self._range = np.repeat([p.gyr_range, p.acc_range], 3)
        self._bias = constant * rng.standard_normal((n_nodes, 6))
        self._drift = self._drift_std * rng.standard_normal((n_nodes, 6))
        self._keep = float(np.exp(-dt / p.drift_tau))

    def sample_3d(self, q_wb: F64, rate_b: F64, accel_w: F64, speed: F64) -> F64:
        """Return one sample of every node that moves in 3D.

        Args:
            q_wb: Orientation, body to world, (node, 4).
            rate_b: Angular rate in the body frame, (node, 3) [rad/s].
            accel_w: World acceleration, (node, 3) [m/s2].
            speed: Speed of the nodes, (node) [m/s].

        Returns:
            Gyroscope [rad/s] and specific force [m/s2] in the body frame, (node, 6).
        """
        force_w = accel_w + np.array([0.0, 0.0, GRAVITY])
        return self._read(np.hstack([rate_b, rotate(quat_conjugate(q_wb), force_w)]), speed)

    def _read(self, truth: F64, speed: F64) -> F64:
        """Return the readings for true angular rates and specific forces, (node, 6)."""
        n = len(truth)
        innovation = np.sqrt(1.0 - self._keep**2) * self._drift_std
        self._drift = self._keep * self._drift + innovation * self._rng.standard_normal((n, 6))
        share = np.minimum(np.abs(speed) / self._params.vibration_speed, 1.0)[:, None]
        spread = np.hypot(self._noise, share * self._vibration)
        reading = truth + self._bias + self._drift + spread * self._rng.standard_normal((n, 6))
        return quantise(reading, self._range, self._params.bits)


def quantise(reading: F64, full_scale: F64 | float, bits: int) -> F64:
    """Clip a reading to +- full scale and round it to the resolution of the converter."""
    clipped = np.clip(reading, -full_scale, full_scale)
    if bits == 0:
        return clipped
    step = np.asarray(full_scale) / 2 ** (bits - 1)
    rounded: F64 = np.round(clipped / step) * step
    return rounded
