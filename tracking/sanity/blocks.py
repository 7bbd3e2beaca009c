"""Usability of measurements, and validity of blocks.

An impossible measurement is skipped; a block that no sensor could have sent is an error.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.constellation import Constellation
from tracking.errors import ConfigError
from tracking.kernels.jit import Call
from tracking.measurements import Kind, MeasurementBlock
from tracking.sanity.measurements import mark_usable


def usable(block: MeasurementBlock) -> MeasurementBlock:
    """Return the block without impossible measurements.

    Events are dropped if they are not finite; ranges if they are of a node with itself, not above
    0 m, or above `FARTHEST`; orientations if they are not rotations. Powers that are not finite are
    removed from their range. Quaternions of nearly unit length are normalised.
    """
    kernel, given = usable_call(block)
    if not kernel(*given):
        return block
    *_, valid, has_power, odd = given
    values = block.values.copy()
    values[odd, :4] /= np.linalg.norm(values[odd, :4], axis=-1, keepdims=True)
    return replace(block, values=values, has_power=has_power, valid=valid)


def usable_call(block: MeasurementBlock) -> Call:
    """Return the kernel that checks a block, with copies of the flags that it changes."""
    flags = block.valid.copy(), block.has_power.copy(), np.empty_like(block.valid)
    return mark_usable, (block.t, block.kind, block.i, block.j, block.values, *flags)


def check(
    block: MeasurementBlock, t_out: F64, n_envs: int, group: Constellation, since: F64
) -> None:
    """Check that kernels, which check none of this, can process a block.

    Args:
        block: Events.
        t_out: Times of the estimates, (1 or env, time) [s].
        n_envs: Environments of the tracker.
        group: Constellation of the tracker.
        since: Time of the last event that it handled, (env) [s].

    Raises:
        ConfigError: The block or the times are invalid.
    """
    if len(block.t) != n_envs:
        raise ConfigError(f"block: expected {n_envs} environments, got {len(block.t)}")
    n = group.n_nodes
    wrong = block.valid & ((block.i < 0) | (block.i >= n) | (block.j < 0) | (block.j >= n))
    if wrong.any():
        raise ConfigError(f"block: expected nodes 0 to {n - 1}, got another")
    ranges = block.valid & np.isin(block.kind, (Kind.RANGE, Kind.SURVEY))
    owner = group.antenna_node
    for antenna, node in ((block.antenna_i, block.i), (block.antenna_j, block.j)):
        known = (antenna >= 0) & (antenna < len(owner))
        if np.any(ranges & ~(known & (owner.take(antenna, mode="clip") == node))):
            raise ConfigError("block: expected antennas of the nodes of a range, got another's")
    t = np.where(block.valid, block.t, -np.inf)
    before = np.maximum.accumulate(np.concatenate([since[:, None], t], axis=1), axis=1)
    if np.any(block.valid & (t < before[:, :-1])):
        raise ConfigError(
            "block: expected events in order of time, none before those of earlier blocks, "
            "see `MeasurementBlock.sorted`"
        )
    if np.isnan(t_out).any() or np.any(np.diff(t_out, axis=1) < 0.0):
        raise ConfigError("t_out: expected times that do not go back")
    if t_out.shape[1] and np.any(t_out[:, 0] < since):
        raise ConfigError("t_out: expected times that are not before the last event handled")
