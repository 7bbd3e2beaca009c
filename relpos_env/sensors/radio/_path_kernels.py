"""Propagation of one message between two moving antennas."""

from __future__ import annotations

import math

import numpy as np

from relpos_env.sensors.radio._channel_kernels import (
    bring_latents,
    path_error,
    path_strength,
    power_gap,
    reported_power,
)
from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._occlusion_kernels import crosses_box, crosses_capsule
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import small_kernel
from tracking.ranging.frames.timestamps import SPEED_OF_LIGHT

MESSAGES, PAIRS, CLOCKS, STARTS = 1 << 40, 2 << 40, 3 << 40, 4 << 40
"""First counters of the random numbers, one per purpose."""
SKIN = 0.9
"""[-] Share of a capsule's radius that occludes."""


@small_kernel
def read_clock(node, t):
    """Return the ticks of a node's clock at a time since the start of the window [s]."""
    return node.base + int(math.floor(node.frac + t * node.rate))


@small_kernel
def nearest_tick(node, t):
    """Return the tick nearest to a time: stamps are rounded, not truncated."""
    return node.base + int(math.floor(node.frac + t * node.rate + 0.5))


@small_kernel
def true_time(node, ticks):
    """Return the time since the start of the window at which a node's clock shows `ticks` [s]."""
    return (float(ticks - node.base) - node.frac) / node.rate


@small_kernel
def distance_moved(scene, k):
    """Return the distance that an antenna moves in the window [m]."""
    x, y, z = (
        scene.pos1[k, 0] - scene.pos0[k, 0],
        scene.pos1[k, 1] - scene.pos0[k, 1],
        scene.pos1[k, 2] - scene.pos0[k, 2],
    )
    return math.sqrt(x * x + y * y + z * z)


@small_kernel
def enter_next_window(node, seed, window, k, dt, wander):
    """Advance clock, clock rate and distance travelled of a node to the next window.

    Args:
        node: NODE, updated.
        seed: Seed of the environment.
        window: Index of the window that ends.
        k: Index of the node.
        dt: Length of the window [s].
        wander: Standard deviation of the relative change of rate in a second [1].
    """
    noise = normal(draw_key(seed, np.uint64(CLOCKS + window * 64 + k)), 0)
    total = node.frac + dt * node.rate
    whole = math.floor(total)
    node.base += int(whole)
    node.frac = total - whole
    node.rate *= 1.0 + wander * math.sqrt(dt) * noise
    node.path += node.step


@small_kernel
def receive(
    c, latent, seed, sender, receiver, s, r, t, pos0, pos1, dt, boxes, capsules, readings, rx
):  # fmt: skip
    """Compute the reception of a message at a node.

    Args:
        c: CHANNEL.
        latent: LATENT of the pair, updated.
        seed: Seed of the environment.
        sender: NODE.
        receiver: NODE.
        s: Index of the sender.
        r: Index of the receiver.
        t: Time of the message's stamp since the start of the window [s].
        pos0: Antennas at the start of the window, (node, 3) [m].
        pos1: Antennas at the end of the window, (node, 3) [m].
        dt: Length of the window [s].
        boxes: Obstacles in the plane, (box, 6).
        capsules: Obstacles in 3D, (capsule, 7).
        readings: True to compute powers and carrier offset, too; nothing else depends on it.
        rx: RECEPTION, written.

    Returns:
        True if the radio detects the message.
    """
    key = draw_key(seed, np.uint64(MESSAGES + sender.sent * 4096 + s * 64 + r))
    share = t / dt
    ax, ay, az = _at(pos0, pos1, s, share)
    bx, by, bz = _at(pos0, pos1, r, share)
    dx, dy, dz = bx - ax, by - ay, bz - az
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    if distance > c.max_distance:
        return False
    nlos = False
    for k in range(boxes.shape[0]):
        if crosses_box(ax, ay, bx, by, boxes[k], 0.0):
            nlos = True
            break
    for k in range(capsules.shape[0]):
        if nlos:
            break
        nlos = crosses_capsule(ax, ay, az, bx, by, bz, capsules[k], SKIN)
    if uniform(key, 0) < (c.loss_nlos if nlos else c.loss):
        return False
    # The receiver moves during the time of flight.
    inverse = 1.0 / max(distance, 1e-9)
    vx, vy, vz = (
        (pos1[r, 0] - pos0[r, 0]) / dt,
        (pos1[r, 1] - pos0[r, 1]) / dt,
        (pos1[r, 2] - pos0[r, 2]) / dt,
    )
    closing = (vx * dx + vy * dy + vz * dz) * inverse
    flown = distance * (1.0 + closing / SPEED_OF_LIGHT)
    travelled = sender.path + receiver.path + (sender.step + receiver.step) * share
    lo, hi = min(s, r), max(s, r)
    pair_key = draw_key(seed, np.uint64(PAIRS + lo * 64 + hi))
    weight = bring_latents(c, latent, pair_key, travelled)
    flown += path_error(c, latent, weight, distance, nlos)
    flown += sender.antenna + receiver.antenna
    rx.src, rx.bad, rx.nlos = s, False, nlos
    rx.stamp = nearest_tick(receiver, t + flown / SPEED_OF_LIGHT + c.stamp_std * normal(key, 0))
    rx.strength = path_strength(c, latent, weight, distance, nlos)
    if readings:
        rx.rx_power = reported_power(c, rx.strength) + c.power_noise * normal(key, 1)
        rx.fp_power = rx.rx_power - power_gap(c, latent, weight, distance, nlos, key)
        ux, uy, uz = (
            (pos1[s, 0] - pos0[s, 0]) / dt,
            (pos1[s, 1] - pos0[s, 1]) / dt,
            (pos1[s, 2] - pos0[s, 2]) / dt,
        )
        receding = ((vx - ux) * dx + (vy - uy) * dy + (vz - uz) * dz) * inverse
        rx.carrier = (
            (receiver.rate - sender.rate) / sender.rate
            + receding / SPEED_OF_LIGHT
            + c.carrier_std * normal(key, 2)
        )
    return True


@small_kernel
def _at(pos0, pos1, k, share):
    return (
        pos0[k, 0] + share * (pos1[k, 0] - pos0[k, 0]),
        pos0[k, 1] + share * (pos1[k, 1] - pos0[k, 1]),
        pos0[k, 2] + share * (pos1[k, 2] - pos0[k, 2]),
    )
