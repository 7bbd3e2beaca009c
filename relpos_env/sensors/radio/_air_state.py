"""Record types of the radio kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relpos_env.sensors.radio.channel import ChannelParams
from tracking.arrays import F64, I64, Bool

Records = NDArray[Any]

_CHANNEL_NUMBERS = (
    "stamp_std", "carrier_std", "bias", "rise", "rise_length", "fast", "slow", "power_1m",
    "attenuation", "shadowing", "ceiling", "knee", "power_noise", "gap", "gap_near", "gap_length",
    "gap_nlos", "gap_skew", "gap_noise", "gap_noise_near", "gap_noise_length", "loss",
    "loss_nlos", "max_distance",
)  # fmt: skip
_CHANNEL_DERIVED = (
    "excess_mu", "excess_sigma", "excess_cap", "gap_place_l", "gap_place_n", "gap_share_excess",
    "gap_share_shadow", "gap_skew_mean", "gap_skew_scale", "rho_fast", "rho_slow", "rho_excess",
    "rho_shadow", "rho_place",
)  # fmt: skip
CHANNEL = np.dtype([(name, "f8") for name in (*_CHANNEL_NUMBERS, *_CHANNEL_DERIVED)])
"""Record type of `ChannelParams` for the kernels, with derived values."""

LATENT = np.dtype(
    [("knot", "i8")]
    + [(f"{z}{k}", "f8") for k in (0, 1) for z in ("fast", "slow", "excess", "shadow", "place")]
)
"""Slowly varying processes of one pair's channel, at two knots of the distance travelled."""

NODE = np.dtype(
    [
        ("on", "?"),
        ("since", "f8"),  # s since the start of the window; no reception until then
        ("base", "i8"),  # local clock at the start of the window, whole ticks
        ("frac", "f8"),  # fraction of a tick to add to it
        ("rate", "f8"),  # ticks per second of true time
        ("path", "f8"),  # m travelled up to the start of the window
        ("step", "f8"),  # m travelled in the window
        ("antenna", "f8"),  # m added to a range by its antenna delay
        ("sent", "i8"),  # messages sent
    ]
)
"""One radio: clock, motion and antenna."""

RECEPTION = np.dtype(
    [
        ("src", "i8"),  # node whose message is being received, -1 if none
        ("bad", "?"),  # the message is corrupted
        ("nlos", "?"),
        ("stamp", "i8"),  # receiver's clock, ticks
        ("strength", "f8"),  # dBm, at the antenna
        ("rx_power", "f8"),  # dBm, as reported
        ("fp_power", "f8"),  # dBm
        ("carrier", "f8"),  # carrier offset [1]
    ]
)
"""Message that a receiver is locked on."""

FLIGHT = np.dtype(
    [
        ("active", "?"),  # scheduled or on the air
        ("moment", "f8"),  # time of its stamp, s since the start of the window
        ("detect", "f8"),  # when receivers can detect it; inf afterwards
        ("end", "f8"),  # end of the message; inf if there is none
    ]
)
"""Message that one node transmits."""


class RadioNumbers(NamedTuple):
    """Values of `RadioSimParams` for the kernels."""

    header_time: float
    detect: float
    capture: float
    wander: float
    airtime: F64
    """Airtime of a message with k rows, (k) [s]."""


class RangeBuffer(NamedTuple):
    """Output buffer for ranges, (env, slot)."""

    t: F64
    """Time of the range, s since the start of the window."""
    i: I64
    j: I64
    values: F64
    """Distance [m], received and first-path power [dBm], (env, slot, 3)."""
    nlos: Bool
    used: I64
    """Number of ranges written, (env)."""


def make_channel(params: ChannelParams, knot: float) -> Records:
    """Return channel parameters and derived values for the kernels, CHANNEL (1)."""
    c = np.zeros(1, dtype=CHANNEL)
    k2 = params.gap_skew**2
    lengths = {
        "fast": params.fast_length,
        "slow": params.slow_length,
        "excess": params.excess_length,
        "shadow": params.shadowing_length,
        "place": params.gap_place_length,
    }
    derived = {
        "excess_mu": params.excess[0],
        "excess_sigma": params.excess[1],
        "excess_cap": params.excess[2],
        "gap_place_l": params.gap_place[0],
        "gap_place_n": params.gap_place[1],
        "gap_share_excess": params.gap_shares[0],
        "gap_share_shadow": params.gap_shares[1],
        "gap_skew_mean": np.exp(0.5 * k2),
        "gap_skew_scale": 1.0 / np.sqrt((np.exp(k2) - 1.0) * np.exp(k2)),
        **{f"rho_{name}": np.exp(-knot / length) for name, length in lengths.items()},
    }
    for name in CHANNEL.names or ():
        c[name] = derived[name] if name in derived else getattr(params, name)
    return c
