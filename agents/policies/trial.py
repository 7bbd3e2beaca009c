"""Smoke test of a network: actions are finite, within limits, and independent of the batch."""

from __future__ import annotations

import numpy as np

from agents.policies.errors import PolicyError
from agents.policies.layout import Layout
from agents.policies.network import N_ACTIONS, Network
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32

DRAWS = 32
"""[-] Number of observations sampled from the whole space, and from its corners."""
SLACK = 1e-6
"""[-] Tolerance of the limits of actions, for rounding."""
SAME = 1e-4
"""[-] Tolerance between actions of a row alone and in a batch, for the order of summation."""


def try_network(network: Network, layout: Layout, where: str) -> None:
    """Run a network on extreme observations.

    Args:
        network: Network to test.
        layout: Layout of its observations.
        where: Name of the network in errors.

    Raises:
        PolicyError: The network fails, actions are not finite or not from -1 to 1, or actions of
            a car depend on the batch.
    """
    observations = extremes(layout)
    actions = network(observations)
    if actions.shape != (len(observations), N_ACTIONS) or actions.dtype != np.float32:
        raise PolicyError(
            where,
            f"actions of {len(observations)} observations: expected float32 of shape "
            f"({len(observations)}, {N_ACTIONS}), got {actions.dtype} of {actions.shape}",
        )
    if not np.isfinite(actions).all():
        raise PolicyError(where, "actions: expected finite numbers, got others on a trial")
    largest = float(np.abs(actions).max())
    if largest > 1.0 + SLACK:
        raise PolicyError(where, f"actions: expected -1 to 1, got {largest:g} on a trial")
    for k in (0, 1, len(observations) - 1):
        alone = network(observations[k : k + 1])
        if alone.shape != (1, N_ACTIONS) or not np.abs(alone[0] - actions[k]).max() <= SAME:
            raise PolicyError(
                where, "actions: expected the same alone and in a batch, got others on a trial"
            )


def extremes(layout: Layout) -> F32:
    """Return zeros, the limits, and random corners and points of the space, (row, size)."""
    space = space_of(layout.fields, layout.history)
    rng = np.random.default_rng(0)
    corners = rng.random((DRAWS, layout.size)) < 0.5
    rows = [
        np.zeros((1, layout.size)),
        space.low[None],
        space.high[None],
        np.where(corners, space.low, space.high),
        rng.uniform(space.low, space.high, (DRAWS, layout.size)),
    ]
    found: F32 = np.concatenate(rows).astype(np.float32)
    return found
