"""A trained policy, loaded from its two files and run."""

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
    """A `Driver` of cars that see what its card says; `driver` fits it to those that see less."""

    def __init__(self, network: Network, card: Card) -> None:
        """Put the two together; `load_policy` does that with files.

        Args:
            network: Checked and tried.
            card: Of this network.
        """
        self.card, self._network = card, network
        self._size = card.layout.size

    @property
    def layout(self) -> Layout:
        """Of the observations that it takes."""
        return self.card.layout

    def act(self, observations: F32) -> F32:
        """Actions of the cars that see the observations, (..., 2), -1 to 1.

        Args:
            observations: (..., size) as `layout` says.

        Raises:
            PolicyError: They have another size, or the actions are not finite.
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
        """What drives cars of an environment.

        Args:
            layout: What they see: the same numbers, or those of fewer cars; positions may be
                estimates for a policy trained on the truth, and the other way round.
            decision: From one action to the next [s].

        Raises:
            PolicyError: It is not made for such cars; says what differs.
        """
        reason = self.layout.refusal(layout)
        if reason is None and abs(decision - self.card.decision) > TINY:
            reason = f"expected a decision every {self.card.decision:g} s, got {decision:g} s"
        if reason is not None:
            raise PolicyError(self.card.name, reason)
        if layout.n_cars == self.layout.n_cars:
            return self
        return PaddedDriver(self, self.layout, layout)


def load_policy(wanted: str | Path) -> TrainedPolicy:
    """Load a policy; nothing is unpickled, and everything is checked before it runs.

    Args:
        wanted: ``name.onnx``, ``name.json``, a folder with one policy, or the name of one that
            comes with the package.

    Raises:
        PolicyError: It is missing, damaged, foreign, or made for something else; says which file
            and why.
    """
    network_file, card_file = find_policy(wanted)
    card = Card.from_json(read_bounded(card_file, MOST_CARD), str(card_file))
    data = read_bounded(network_file, MOST_NETWORK)
    return TrainedPolicy(check_policy(data, card, str(network_file)), card)


def check_policy(data: bytes, card: Card, where: str) -> Network:
    """The network of a card, if the two belong together and can drive these cars.

    Args:
        data: Bytes of the network's file.
        card: Its card.
        where: What the network is called in errors.

    Raises:
        PolicyError: They do not.
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
