"""Trained policies as contenders."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agents.driver import Driver
from agents.policies import Layout, TrainedPolicy, load_policy, shipped_names


@dataclass(frozen=True, slots=True)
class TrainedEntry:
    """A policy: it drives cars that see what it was made for, and fewer of them."""

    policy: TrainedPolicy

    @property
    def title(self) -> str:
        """What its card calls it."""
        return self.policy.card.name

    @property
    def trained_on(self) -> str:
        """Observation mode of its layout."""
        return self.policy.layout.observation

    @property
    def history(self) -> int:
        """So many observations it sees in one."""
        return self.policy.layout.history

    @property
    def proximity(self) -> int:
        """Beams that it was trained with."""
        return self.policy.layout.proximity

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """Why it cannot drive so many cars on a mode of observations; None if it can."""
        seen = Layout(observation, n_cars, self.history, proximity)
        return self.policy.layout.refusal(seen)

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """The policy, fitted to so many cars."""
        return self.policy.driver(Layout(observation, n_cars, self.history, proximity))


def find_trained(name: str) -> TrainedEntry | None:
    """The policy of a name, file or folder; None for what looks like none of them.

    Raises:
        PolicyError: It is missing, damaged or foreign.
    """
    path = Path(name)
    if name in shipped_names() or path.suffix or len(path.parts) > 1 or path.exists():
        return TrainedEntry(load_policy(name))
    return None
