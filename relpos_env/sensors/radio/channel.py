"""Channel model: delay, power and loss of a message. Parameters of five radio environments.

d is the distance, s the sum of the distances that both ends have travelled, and every z a process
of unit variance with correlation exp(-s / length): errors are constant while nodes are at rest,
as for real multipath:

    range error = bias + rise (1 - exp(-(d - 2 m) / rise_length)) + fast z1 + slow z2
                  [+ cap / (1 + exp(-(mu + sigma z3))) behind an obstacle]
    power       = ceiling - knee ln(1 + exp((ceiling - p) / knee)),
                  p = power_1m - 20 log10 d + shadowing z4 [- attenuation]
    power gap   = gap + gap_near exp(-d / gap_length) [+ gap_nlos] + place LN(z5) + noise

LN is a log-normal of mean 0 and unit variance; z5 is correlated with z3 and z4. White noise is
added to the receive stamps and to the readings. `docs/explanation/simulator.md` compares the
model with measurements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelParams:
    """Channel parameters of one radio environment."""

    stamp_std: float = 156e-12
    """[s] White noise of a receive stamp; 3 cm in a range of three of them."""
    carrier_std: float = 0.15e-6
    """[1] Noise of the carrier offset that is read from a message."""
    bias: float = 0.0
    """[m] Constant range error."""
    rise: float = 0.0
    """[m] Further bias at large distances, due to the falling power."""
    rise_length: float = 15.5
    """[m] Length constant of `rise`."""
    fast: float = 0.0304
    """[m] Standard deviation of multipath errors that change within decimetres."""
    fast_length: float = 0.40
    """[m] Correlation length of `fast`."""
    slow: float = 0.0421
    """[m] Standard deviation of multipath and antenna errors that change within metres."""
    slow_length: float = 10.0
    """[m] Correlation length of `slow`."""
    excess: tuple[float, float, float] = (-3.366, 2.721, 0.67)
    """mu [1], sigma [1], cap [m] of the excess (NLOS bias) behind an obstacle."""
    excess_length: float = 3.9
    """[m] Correlation length of the excess."""
    power_1m: float = -51.65
    """[dBm] Received power at a distance of 1 m, without the ceiling."""
    attenuation: float = 6.0
    """[dB] Attenuation by an obstacle."""
    shadowing: float = 4.0
    """[dB] Standard deviation of the shadowing."""
    shadowing_length: float = 1.0
    """[m] Correlation length of the shadowing."""
    ceiling: float = -79.07
    """[dBm] Largest power that the radio reports, without noise."""
    knee: float = 3.86
    """[dB] Width of the transition to the ceiling."""
    power_noise: float = 0.4
    """[dB] White noise of a power reading."""
    gap: float = 3.0
    """[dB] Mean power gap (received minus first-path power) in LOS, far away."""
    gap_near: float = 0.0
    """[dB] Increase of the power gap at distance 0."""
    gap_length: float = 8.7
    """[m] Length constant of `gap_near`."""
    gap_nlos: float = 5.0
    """[dB] Increase of the power gap behind an obstacle."""
    gap_place: tuple[float, float] = (0.8, 2.5)
    """[dB] Standard deviation of the power gap between positions, LOS and NLOS."""
    gap_place_length: float = 1.0
    """[m] Correlation length of `gap_place`."""
    gap_skew: float = 0.4
    """[1] Shape of LN."""
    gap_shares: tuple[float, float] = (0.5, 0.0)
    """[1] Correlation of z5 with the excess (behind obstacles) and with the shadowing."""
    gap_noise: float = 0.6
    """[dB] White noise of the power gap, far away."""
    gap_noise_near: float = 0.0
    """[dB] Increase of the white noise at distance 0."""
    gap_noise_length: float = 20.2
    """[m] Length constant of `gap_noise_near`."""
    loss: float = 0.004
    """[1] Share of messages lost in LOS."""
    loss_nlos: float = 0.1
    """[1] Share of messages lost behind an obstacle; a range needs three or four messages."""
    max_distance: float = 60.0
    """[m] Largest distance of a reception."""


CALIBRATED = ChannelParams()
"""Room of the paper's cars after an affine calibration: 6 cm in LOS, white and correlated errors
together. The excess is set so that errors of the whole NLOS run equal its 11.6 cm."""

INDOOR = ChannelParams(fast=0.062, slow=0.0858, excess=(-3.366, 2.721, 1.536))
"""Buildings, not calibrated: published errors of -0.07 +- 0.11 m in LOS (without the offset),
0.23 +- 0.38 m and 17 % beyond 0.5 m in NLOS; correlation 0.85 after 50 ms and 0.5 after a second
of walking; power gaps of 2 to 4 dB and around 8 dB."""

HALL = replace(INDOOR, excess=(-1.497, 2.283, 3.125), excess_length=3.3, attenuation=8.0)
"""A hall full of steel: errors of 0.94 +- 0.94 m behind obstacles, median 0.58 m."""

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
"""Radios worn by people, calibrated; in LOS as `CALIBRATED`. Differences:

excess cap: the shape of `INDOOR`, scaled so that the errors of NLOS pairs equal the 27.5 cm
    (root mean square) that Armani and Holz report for occluded pairs on a body (ICRA 2024).
excess_length: equal to the length of the shadowing, since the posture causes both.
attenuation: the first path around a body falls with exponents of 9 to 13 ("Path loss modeling
    for UWB creeping waves around human body", anechoic, 2 GHz to 8 GHz); a body attenuates the
    direct path strongly, while the path around it is hardly longer (Kilic et al., WPNC 2012).
    Errors thus come from later paths detected as the first. Twice that of `INDOOR` is assumed.

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
