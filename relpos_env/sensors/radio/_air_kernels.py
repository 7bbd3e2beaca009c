"""Clocks, antennas and single messages of one environment, for the reference air."""

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
        seed: Of the environment, uint64.
        clock_offset: `RadioSimParams`.
        antenna_std: `RadioSimParams`.
    """
    for k in range(nodes.shape[0]):
        key = draw_key(seed, np.uint64(STARTS + k))
        offset = min(max(clock_offset * normal(key, 0), -20e-6), 20e-6)
        nodes[k].base = int(uniform(key, 2) * 2.0**39) + 2**38
        nodes[k].rate = TICK_HZ * (1.0 + offset)
        nodes[k].antenna = antenna_std * normal(key, 1)


@kernel
def next_window(nodes, seed, window, wander, dt):
    """Move the clocks of one environment to the next window."""
    for k in range(nodes.shape[0]):
        enter_next_window(nodes[k], seed, window, k, dt, wander)


@kernel
def local_now(nodes, k, t):
    """Ticks of a node's clock at a time since the start of the window [s]."""
    return read_clock(nodes[k], t)


@kernel
def true_at(nodes, k, ticks):
    """Time since the start of the window [s] at which a node's clock shows so many ticks."""
    return true_time(nodes[k], ticks)


@kernel
def hear_message(channel, latents, seed, nodes, s, r, t, motion, boxes, capsules, receptions):
    """Whether node r detects the message of node s; what it hears goes to its RECEPTION.

    Args:
        channel: CHANNEL, (1).
        latents: LATENT, (node, node), the part above the diagonal is used and updated.
        seed: Of the environment, uint64.
        nodes: NODE, (node).
        s: Sender.
        r: Receiver.
        t: Stamp moment since the start of the window [s].
        motion: Antennas at its start and end, (node, 3) [m], and its length [s].
        boxes: What stands in the plane, (box, 6).
        capsules: What stands in space, (capsule, 7).
        receptions: RECEPTION, (node), written.
    """
    pos0, pos1, dt = motion
    latent = latents[min(s, r), max(s, r)]
    return receive(
        channel[0], latent, seed, nodes[s], nodes[r], s, r, t, pos0, pos1, dt,
        boxes, capsules, True, receptions[r],
    )  # fmt: skip
