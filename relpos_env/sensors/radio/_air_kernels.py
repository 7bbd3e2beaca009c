"""Clocks, antennas and single messages of one environment, for the reference in `air`."""

from __future__ import annotations

import numpy as np

from relpos_env.sensors.radio._normal_kernels import normal
from relpos_env.sensors.radio._path_kernels import (
    STARTS,
    enter_next_window,
    read_clock,
    receive,
    true_time,
)
from relpos_env.sensors.radio._random_kernels import draw_key, uniform
from tracking.kernels.jit import kernel
from tracking.ranging.frames.timestamps import TICK_HZ


@kernel
def make_nodes(nodes, seed, clock_offset, antenna_std):
    """Draw clocks and antennas of one environment.

    Args:
        nodes: NODE, (node), written.
        seed: Seed of the environment, uint64.
        clock_offset: As in `RadioSimParams` [1].
        antenna_std: `RadioSimParams.antenna_delay_std` [m].
    """
    for k in range(nodes.shape[0]):
        key = draw_key(seed, np.uint64(STARTS + k))
        offset = min(max(clock_offset * normal(key, 0), -20e-6), 20e-6)
        nodes[k].base = int(uniform(key, 2) * 2.0**39) + 2**38
        nodes[k].rate = TICK_HZ * (1.0 + offset)
        nodes[k].antenna = antenna_std * normal(key, 1)


@kernel
def next_window(nodes, seed, window, wander, dt):
    """Advance the clocks of one environment to the next window."""
    for k in range(nodes.shape[0]):
        enter_next_window(nodes[k], seed, window, k, dt, wander)


@kernel
def local_now(nodes, k, t):
    """Return the ticks of a node's clock at a time since the start of the window [s]."""
    return read_clock(nodes[k], t)


@kernel
def true_at(nodes, k, ticks):
    """Return the time since the start of the window at which a node's clock shows `ticks` [s]."""
    return true_time(nodes[k], ticks)


@kernel
def receive_message(channel, latents, seed, nodes, s, r, t, motion, boxes, capsules, receptions):
    """Return whether node r detects the message of node s, and write its RECEPTION.

    Args:
        channel: CHANNEL, (1).
        latents: LATENT, (node, node), the part above the diagonal is used and updated.
        seed: Seed of the environment, uint64.
        nodes: NODE, (node).
        s: Index of the sender.
        r: Index of the receiver.
        t: Time of the message's stamp since the start of the window [s].
        motion: Antennas at the start and end of the window, (node, 3) [m], and its length [s].
        boxes: Obstacles in the plane, (box, 6).
        capsules: Obstacles in 3D, (capsule, 7).
        receptions: RECEPTION, (node), written.
    """
    pos0, pos1, dt = motion
    latent = latents[min(s, r), max(s, r)]
    return receive(
        channel[0], latent, seed, nodes[s], nodes[r], s, r, t, pos0, pos1, dt,
        boxes, capsules, True, receptions[r],
    )  # fmt: skip
