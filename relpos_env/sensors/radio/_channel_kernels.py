"""The formulas of `relpos_env.sensors.radio.channel`, for one message between two antennas."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import small_kernel

_DECIBEL = 20.0 / math.log(10.0)
KNOT = 0.05
"""[m] Distance between knots of the processes, which are linear in between."""


@small_kernel
def bring_latents(c, latent, key, travelled):
    """Advance the processes of a pair to the distance travelled.

    Args:
        c: CHANNEL.
        latent: LATENT of the pair, updated.
        key: Key of the pair's draws.
        travelled: Sum of the distances travelled by both ends [m]; must not decrease.

    Returns:
        Weight of the later knot.
    """
    while latent.knot < 0 or travelled > (latent.knot + 1) * KNOT:
        latent.knot += 1
        if latent.knot == 0:
            _draw_knot(c, latent, key, 0, False)
        _draw_knot(c, latent, key, latent.knot + 1, True)
    return travelled / KNOT - latent.knot


@small_kernel
def _draw_knot(c, latent, key, knot, correlated):
    """Advance from the previous knot to `knot`."""
    here = draw_key(key, np.uint64(knot))
    latent.fast0, latent.slow0, latent.excess0 = latent.fast1, latent.slow1, latent.excess1
    latent.shadow0, latent.place0 = latent.shadow1, latent.place1
    latent.fast1 = _step(c.rho_fast, latent.fast0, normal(here, 0), correlated)
    latent.slow1 = _step(c.rho_slow, latent.slow0, normal(here, 1), correlated)
    latent.excess1 = _step(c.rho_excess, latent.excess0, normal(here, 2), correlated)
    latent.shadow1 = _step(c.rho_shadow, latent.shadow0, normal(here, 3), correlated)
    latent.place1 = _step(c.rho_place, latent.place0, normal(here, 4), correlated)


@small_kernel
def _step(rho, last, noise, correlated):
    if not correlated:
        return noise
    return rho * last + math.sqrt(1.0 - rho * rho) * noise


@small_kernel
def path_error(c, latent, weight, distance, nlos):
    """Return the range error without the noise of the stamps [m]."""
    error = c.bias
    if distance > 2.0 and c.rise != 0.0:
        error += c.rise * (1.0 - math.exp(-(distance - 2.0) / c.rise_length))
    error += c.fast * _mix(latent.fast0, latent.fast1, weight) + c.slow * _mix(
        latent.slow0, latent.slow1, weight
    )
    if nlos:
        z = _mix(latent.excess0, latent.excess1, weight)
        error += c.excess_cap / (1.0 + math.exp(-(c.excess_mu + c.excess_sigma * z)))
    return error


@small_kernel
def path_strength(c, latent, weight, distance, nlos):
    """Return the power at the antenna [dBm]."""
    p = c.power_1m - _DECIBEL * math.log(max(distance, 0.1))
    return (
        p
        + c.shadowing * _mix(latent.shadow0, latent.shadow1, weight)
        - (c.attenuation if nlos else 0.0)
    )


@small_kernel
def reported_power(c, strength):
    """Return the power that the radio reports, without the noise of the reading [dBm]."""
    below = (c.ceiling - strength) / c.knee
    if below > 30.0:
        return strength
    return c.ceiling - c.knee * math.log1p(math.exp(below))


@small_kernel
def power_gap(c, latent, weight, distance, nlos, key):
    """Return the received minus first-path power [dB]."""
    share_e = c.gap_share_excess if nlos else 0.0
    rest = math.sqrt(1.0 - share_e * share_e - c.gap_share_shadow * c.gap_share_shadow)
    z = rest * _mix(latent.place0, latent.place1, weight) + c.gap_share_shadow * _mix(
        latent.shadow0, latent.shadow1, weight
    )
    z += share_e * _mix(latent.excess0, latent.excess1, weight)
    k = c.gap_skew
    place = (math.exp(k * z) - c.gap_skew_mean) * c.gap_skew_scale
    gap = c.gap + (c.gap_nlos if nlos else 0.0) + (c.gap_place_n if nlos else c.gap_place_l) * place
    noise = c.gap_noise
    if c.gap_near != 0.0 or c.gap_noise_near != 0.0:
        gap += c.gap_near * math.exp(-distance / c.gap_length)
        noise += c.gap_noise_near * math.exp(-distance / c.gap_noise_length)
    u = uniform(key, 5)
    return gap + noise * (u * u - 1.0 / 3.0) / 0.298


@small_kernel
def _mix(before, after, weight):
    return before + weight * (after - before)
