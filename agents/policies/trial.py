"""A network is tried before it drives anything: finite, within limits, one row as good as many."""

from __future__ import annotations

import numpy as np

from agents.policies.errors import PolicyError
from agents.policies.layout import Layout
from agents.policies.network import N_ACTIONS, Network
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32

DRAWS = 32
"""[-] Observations drawn from the whole space, and from its corners, each."""
SLACK = 1e-6
"""[-] Actions may be beyond 1 by the last bit."""
SAME = 1e-4
"""[-] Actions of a row in a batch and of the row alone may differ by the order of sums."""


def try_network(network: Network, layout: Layout, where: str) -> None:
    """Run a network on extreme observations.

    Args:
        network: To try.
        layout: Of its observations.
        where: What it is called in errors.

    Raises:
        PolicyError: It fails, or its actions are no numbers from -1 to 1, or those of a car depend
            on who else is in the batch.
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
    """Nothing, the limits, random corners of the space, and anything in it, (row, size)."""
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
