"""Permitted ranges of the parameters of cars, sensors and radios.

The ranges are wide: they catch mistakes (percent for a fraction, degrees for radians, a negative
deviation, NaN) and allow experiments.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from relpos_env.errors import EnvError
from relpos_env.interface.rangefinders import FARTHEST
from relpos_env.sensors.imu import ImuSimParams
from relpos_env.sensors.magnetometer import MagSimParams
from relpos_env.sensors.odometer import OdometerSimParams
from relpos_env.sensors.proximity import ProximitySimParams
from relpos_env.sensors.radio.channel import ChannelParams
from relpos_env.sensors.radio.params import RadioSimParams
from relpos_env.world.car import CarParams
from tracking.ranging.frames.airtime import Phy

Range = tuple[float, float]
_ANY: Range = (-1e6, 1e6)
_DEVIATION: Range = (0.0, 1e4)
_LENGTH: Range = (1e-3, 1e6)
_SHARE: Range = (0.0, 1.0)

LIMITS: dict[type, dict[str, Range]] = {
    CarParams: {
        "mass": (0.1, 100.0),
        "length": (0.05, 3.0),
        "width": (0.02, 3.0),
        "wheelbase": (0.02, 3.0),
        "friction": (0.01, 10.0),
        "max_speed": (0.05, 30.0),
        "max_accel": (0.05, 100.0),
        "speed_gain": (0.01, 100.0),
        "max_steering": (0.01, 1.4),
        "steering_rate": (0.01, 1000.0),
    },
    ImuSimParams: {
        "drift_tau": _LENGTH,
        "vibration_speed": _LENGTH,
        "gyr_range": _LENGTH,
        "acc_range": _LENGTH,
        "bits": (0, 32),
    },
    MagSimParams: {
        "field_w": (-1e4, 1e4),
        "wavelength": _LENGTH,
        "n_waves": (0, 1000),
        "full_scale": _LENGTH,
        "bits": (0, 32),
    },
    OdometerSimParams: {"scale_std": _SHARE},
    ProximitySimParams: {
        "max_range": (0.1, FARTHEST),
        "cone": (0.0, 1.5),
        "noise_std": (0.0, FARTHEST),
        "noise_share": _SHARE,
    },
    RadioSimParams: {
        "clock_offset": (0.0, 1e-4),
        "clock_wander": (0.0, 1e-6),
        "antenna_delay_std": (0.0, 10.0),
        "capture": (0.0, 200.0),
        "antenna_height": (0.0, 10.0),
    },
    ChannelParams: {
        "stamp_std": (0.0, 1e-6),
        "carrier_std": (0.0, 1e-3),
        "excess": _ANY,
        "knee": _LENGTH,
        "gap_skew": (1e-3, 3.0),
        "loss": _SHARE,
        "loss_nlos": _SHARE,
        "max_distance": (0.1, 1e6),
        **dict.fromkeys(("bias", "rise", "power_1m", "attenuation", "ceiling", "gap"), _ANY),
        **dict.fromkeys(("gap_near", "gap_nlos", "gap_noise_near"), _ANY),
        "gap_shares": (-1.0, 1.0),
        **{f.name: _LENGTH for f in fields(ChannelParams) if f.name.endswith("_length")},
    },
    Phy: {
        "preamble_symbols": (16, 1 << 16),
        "sfd_symbols": (1, 1 << 10),
        **dict.fromkeys(("header_bit", "data_bit", "symbol"), (1e-9, 1e-3)),
        **dict.fromkeys(("detect", "sense", "turnaround", "processing"), (0.0, 1.0)),
    },
}
"""Minimum and maximum by parameter; unnamed ones are deviations, 0 to 10,000."""


def check_params(path: str, params: Any) -> None:
    """Check the range of parameters, nested ones included.

    Args:
        path: Path of the parameters in errors, such as `radio.channel`.
        params: Frozen dataclass of numbers, tuples and dataclasses.

    Raises:
        EnvError: Out of range; names the field and the permitted range.
    """
    limits = LIMITS.get(type(params))
    for f in fields(params):
        value = getattr(params, f.name)
        if is_dataclass(value):
            check_params(f"{path}.{f.name}", value)
        elif limits is not None:
            low, high = limits.get(f.name, _DEVIATION)
            for number in value if isinstance(value, tuple) else (value,):
                if isinstance(number, (int, float)) and not low <= number <= high:
                    raise EnvError(f"{path}.{f.name}: expected {low:g} to {high:g}, got {number}")
    if isinstance(params, ChannelParams):
        _check_channel(path, params)


def _check_channel(path: str, channel: ChannelParams) -> None:
    _, sigma, cap = channel.excess
    if sigma < 0.0 or cap < 0.0:
        raise EnvError(f"{path}.excess: expected sigma and cap of 0 or more, got {sigma}, {cap}")
    if sum(share**2 for share in channel.gap_shares) > 1.0:
        raise EnvError(
            f"{path}.gap_shares: expected squares that sum to at most 1, got {channel.gap_shares}"
        )
