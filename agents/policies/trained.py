"""Trained policies: loading from two files, validation, and inference."""

from __future__ import annotations

import hashlib
from math import prod
from pathlib import Path

import numpy as np

from agents.driver import Driver
from agents.policies.card import Card
from agents.policies.errors import PolicyError
from agents.policies.find import MOST_CARD, MOST_NETWORK, find_policy, read_bounded
from agents.policies.layout import Layout
from agents.policies.network import Network
from agents.policies.padding import PaddedDriver
from agents.policies.trial import SLACK, try_network
from relpos_env.interface.actions import MAX_SPEED, MAX_STEERING
from relpos_env.interface.observations.base import F32
from relpos_env.timing import DECISION

TINY = 1e-9


class TrainedPolicy:
    """A `Driver` for the layout of its card; `driver` adapts it to layouts of fewer cars."""

    def __init__(self, network: Network, card: Card) -> None:
        """Combine network and card; `load_policy` does this with files.

        Args:
            network: Network, validated by `check_policy`.
            card: Card of the network.
        """
        self.card, self._network = card, network
        self._size = card.layout.size

    @property
    def layout(self) -> Layout:
        """Layout of the observations."""
        return self.card.layout

    def act(self, observations: F32) -> F32:
        """Return the actions for observations, (..., 2), -1 to 1.

        Args:
            observations: Observations as in `layout`, (..., size).

        Raises:
            PolicyError: The observations have another size, or actions are out of range.
        """
        rows = np.asarray(observations, dtype=np.float32)
        lead = rows.shape[:-1]
        if rows.shape[-1:] != (self._size,):
            expected = f"observations: expected (..., {self._size}), got {rows.shape}"
            raise PolicyError(self.card.name, expected)
        if not prod(lead):
            return np.zeros((*lead, 2), dtype=np.float32)
        actions = self._network(np.ascontiguousarray(rows.reshape(-1, self._size)))
        if not (largest := np.abs(actions).max()) <= 1.0 + SLACK:
            wrong = f"{largest:g}" if np.isfinite(largest) else "others"
            raise PolicyError(
                self.card.name, f"actions: expected finite numbers from -1 to 1, got {wrong}"
            )
        return actions.reshape(*lead, 2)

    def driver(self, layout: Layout, *, decision: float = DECISION) -> Driver:
        """Return a driver for the cars of an environment.

        Args:
            layout: Layout of the environment: the same, or of fewer cars; a policy trained on the
                true state also runs on estimates, and vice versa.
            decision: Control period [s].

        Raises:
            PolicyError: The policy does not fit the environment; names the difference.
        """
        reason = self.layout.refusal(layout)
        if reason is None and abs(decision - self.card.decision) > TINY:
            reason = f"expected a decision every {self.card.decision:g} s, got {decision:g} s"
        if reason is not None:
            raise PolicyError(self.card.name, reason)
        if layout.n_cars == self.layout.n_cars:
            return self
        return PaddedDriver(self, self.layout, layout)


def load_policy(name_or_path: str | Path) -> TrainedPolicy:
    """Load a policy without unpickling, and validate it before it runs.

    Args:
        name_or_path: ``name.onnx``, ``name.json``, a folder with one policy, or the name of a
            policy of the package.

    Raises:
        PolicyError: The policy is missing, damaged, or incompatible; names the file and the reason.
    """
    network_file, card_file = find_policy(name_or_path)
    card = Card.from_json(read_bounded(card_file, MOST_CARD), str(card_file))
    data = read_bounded(network_file, MOST_NETWORK)
    return TrainedPolicy(check_policy(data, card, str(network_file)), card)


def check_policy(data: bytes, card: Card, where: str) -> Network:
    """Return the network of a card, checked to belong to it and to fit the cars.

    Args:
        data: Content of the network's file.
        card: Card of the network.
        where: Name of the network in errors.

    Raises:
        PolicyError: The network does not belong to the card, or does not fit the cars.
    """
    found = hashlib.sha256(data).hexdigest()
    if found != card.onnx_sha256:
        raise PolicyError(
            where,
            f"is not the network of the card: expected SHA-256 {card.onnx_sha256}, got {found}",
        )
    for name, unit, limit, ours in (
        ("speed", "m/s", card.max_speed, MAX_SPEED),
        ("steering", "rad", card.max_steering, MAX_STEERING),
    ):
        if abs(limit - ours) > TINY:
            raise PolicyError(where, f"is for {name} up to {limit:g} {unit}, expected {ours:g}")
    network = Network(data, card.layout.size, where)
    try_network(network, card.layout, where)
    return network
