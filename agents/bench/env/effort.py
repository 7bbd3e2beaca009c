"""How much is measured, and for how long."""

from __future__ import annotations

from dataclasses import dataclass

EPISODE = 600
"""[-] Steps of an episode, ours and the peers'."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much of everything `relpos bench env` does."""

    envs: int = 64
    """Environments of the figures with a peer and of the parts."""
    two_cores: tuple[int, ...] = (64, 256)
    """Environments that two threads share, one figure each; two processes have the first number
    each."""
    growth_envs: tuple[int, ...] = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
    """Environments of the curve over them, with three cars."""
    growth_cars: tuple[int, ...] = (2, 3, 5, 10, 20)
    """Cars of the curve over them, with `envs` environments."""
    turns: int = 10
    """The best of so many counts."""
    resets: int = 4
    """Episodes that begin in a turn, which has as many steps as that takes."""
    warm_up: int = 100
    """Steps before the first turn: until the trackers have settled."""
    patience: float = 8.0
    """[s] A point of a curve takes no new turn after so long."""


FULL = Effort()
QUICK = Effort(
    two_cores=(64,),
    growth_envs=(1, 8, 64),
    growth_cars=(2, 3, 5),
    turns=4,
    resets=2,
    warm_up=50,
    patience=3.0,
)
"""A first impression in a minute or two."""
