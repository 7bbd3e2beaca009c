"""Trained policies as candidates of a comparison."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from agents.driver import Driver
from agents.policies import Layout, TrainedPolicy, load_policy, shipped_names


@dataclass(frozen=True, slots=True)
class TrainedEntry:
    """A policy, for its observation layout and at most its number of cars."""

    policy: TrainedPolicy

    @property
    def title(self) -> str:
        """Name in the model card."""
        return self.policy.card.name

    @property
    def trained_on(self) -> str:
        """Observation mode of its layout."""
        return self.policy.layout.observation

    @property
    def history(self) -> int:
        """Number of stacked observations."""
        return self.policy.layout.history

    @property
    def proximity(self) -> int:
        """Distance sensors that it was trained with."""
        return self.policy.layout.proximity

    def refusal(self, observation: str, n_cars: int, proximity: int) -> str | None:
        """Return the reason for an incompatible mode or number of cars; None if compatible."""
        seen = Layout(observation, n_cars, self.history, proximity)
        return self.policy.layout.refusal(seen)

    def driver(self, observation: str, n_cars: int, proximity: int) -> Driver:
        """Return the policy, adapted to the number of cars."""
        return self.policy.driver(Layout(observation, n_cars, self.history, proximity))


def find_trained(name: str) -> TrainedEntry | None:
    """Return the policy of a name, file or folder; None if `name` looks like none of them.

    Raises:
        PolicyError: The policy is missing, damaged or foreign.
    """
    path = Path(name)
    if name in shipped_names() or path.suffix or len(path.parts) > 1 or path.exists():
        return TrainedEntry(load_policy(name))
    return None
