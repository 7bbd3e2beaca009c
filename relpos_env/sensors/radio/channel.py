"""What the air does to a message on its way: delay, power, loss. Parameters of five places.

With d the distance, s the way that both ends have travelled together, and every z a process of
unit variance with correlation exp(-s / length), so that errors stay while nodes stand still,
as real multipath does:

    range error = bias + rise (1 - exp(-(d - 2 m) / rise_length)) + fast z1 + slow z2
                  [+ cap / (1 + exp(-(mu + sigma z3))) behind an obstacle]
    power       = ceiling - knee ln(1 + exp((ceiling - p) / knee)),
                  p = power_1m - 20 log10 d + shadowing z4 [- attenuation]
    power gap   = gap + gap_near exp(-d / gap_length) [+ gap_nlos] + place LN(z5) + noise

LN is a log-normal of mean 0 and unit variance; z5 shares parts with z3 and z4. White noise is
added to the receive stamps and to the readings. `docs/explanation/simulator.md` shows what it is
worth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelParams:
    """One kind of place."""

    stamp_std: float = 156e-12
    """[s] White noise of a receive stamp; 3 cm in a range of three of them."""
    carrier_std: float = 0.15e-6
    """[1] Noise of the carrier offset that is read from a message."""
    bias: float = 0.0
    """[m]"""
    rise: float = 0.0
    """[m] Further bias far away, by the falling power."""
    rise_length: float = 15.5
    """[m]"""
    fast: float = 0.0304
    """[m] Multipath that changes within decimetres."""
    fast_length: float = 0.40
    """[m]"""
    slow: float = 0.0421
    """[m] Multipath and antennas, changing within metres."""
    slow_length: float = 10.0
    """[m]"""
    excess: tuple[float, float, float] = (-3.366, 2.721, 0.67)
    """mu [1], sigma [1], cap [m] of the excess behind an obstacle."""
    excess_length: float = 3.9
    """[m]"""
    power_1m: float = -51.65
    """[dBm] At a metre, before the ceiling."""
    attenuation: float = 6.0
    """[dB] By an obstacle."""
    shadowing: float = 4.0
    """[dB]"""
    shadowing_length: float = 1.0
    """[m]"""
    ceiling: float = -79.07
    """[dBm] The radio reports no more than this."""
    knee: float = 3.86
    """[dB]"""
    power_noise: float = 0.4
    """[dB]"""
    gap: float = 3.0
    """[dB] Received minus first-path power."""
    gap_near: float = 0.0
    """[dB]"""
    gap_length: float = 8.7
    """[m]"""
    gap_nlos: float = 5.0
    """[dB] More of it behind an obstacle."""
    gap_place: tuple[float, float] = (0.8, 2.5)
    """[dB] Standard deviation from place to place, in sight and not."""
    gap_place_length: float = 1.0
    """[m]"""
    gap_skew: float = 0.4
    """[1] Shape of LN."""
    gap_shares: tuple[float, float] = (0.5, 0.0)
    """[1] Of the excess (behind obstacles) and of the shadowing in the gap."""
    gap_noise: float = 0.6
    """[dB] White, far away."""
    gap_noise_near: float = 0.0
    """[dB] More of it near by."""
    gap_noise_length: float = 20.2
    """[m]"""
    loss: float = 0.004
    """[1] Share of messages lost in sight."""
    loss_nlos: float = 0.1
    """[1] Share of messages lost behind an obstacle; a range needs three or four messages."""
    max_distance: float = 60.0
    """[m] Nothing is heard beyond."""


CALIBRATED = ChannelParams()
"""The room of the paper's cars after an affine calibration: 6 cm in sight, white and not, and
so much behind an obstacle that the errors of the whole NLOS run come to its 11.6 cm."""

INDOOR = ChannelParams(fast=0.062, slow=0.0858, excess=(-3.366, 2.721, 1.536))
"""Buildings, not calibrated: published errors of -0.07 +- 0.11 m in sight (without the offset),
0.23 +- 0.38 m and 17 % beyond 0.5 m behind obstacles; correlation 0.85 after 50 ms and 0.5 after
a second of walking; gaps of 2 to 4 dB and around 8 dB."""

HALL = replace(INDOOR, excess=(-1.497, 2.283, 3.125), excess_length=3.3, attenuation=8.0)
"""A hall full of steel: 0.94 +- 0.94 m behind obstacles, median 0.58 m."""

OUTDOOR = ChannelParams(
    stamp_std=134e-12,
    bias=-0.026,
    rise=0.331,
    fast=0.0246,
    fast_length=2.1,
    slow=0.015,
    slow_length=100.0,
    excess=(-1.080, 2.064, 0.1014),
    excess_length=22.0,
    attenuation=2.4,
    shadowing=4.1,
    shadowing_length=4.8,
    gap=0.469,
    gap_near=2.083,
    gap_nlos=0.0,
    gap_place=(0.29, 0.564),
    gap_place_length=2.3,
    gap_skew=0.8,
    gap_shares=(-0.2, -0.5),
    gap_noise=0.906,
    gap_noise_near=-0.860,
    max_distance=100.0,
)
"""An open field, fitted to 67,105 ranges of 2 m to 60 m with known truth (Hanyang University)."""

BODY = ChannelParams(
    excess=(-3.366, 2.721, 0.959),
    excess_length=1.0,
    attenuation=12.0,
)
"""People who wear the radios, calibrated; in sight as `CALIBRATED`. What differs:

excess cap: the shape of `INDOOR`, scaled so that the errors of hidden pairs come to the 27.5 cm
    (root mean square) that Armani and Holz report for occluded pairs on a body (ICRA 2024).
excess_length: the excess has the same cause as the shadowing, the posture, and its length.
attenuation: the first path round a body falls with exponents of 9 to 13 ("Path loss modeling
    for UWB creeping waves around human body", anechoic, 2 GHz to 8 GHz); a body weakens the
    direct path much, while the way round it is hardly longer (Kilic et al., WPNC 2012). So the
    errors come from later paths that are taken for the first. Twice that of `INDOOR` is assumed.

Losses and the power gap are those of `INDOOR`; for bodies both are assumed."""

EXACT = ChannelParams(
    stamp_std=0.0, carrier_std=0.0, fast=0.0, slow=0.0, excess=(0.0, 0.0, 0.0), loss=0.0,
    loss_nlos=0.0, power_noise=0.0, gap_noise=0.0, gap_place=(0.0, 0.0), shadowing=0.0,
)  # fmt: skip
"""No error at all, for tests and for measuring the protocol alone."""

CHANNELS = {
    "calibrated": CALIBRATED,
    "indoor": INDOOR,
    "hall": HALL,
    "outdoor": OUTDOOR,
    "body": BODY,
    "exact": EXACT,
}
