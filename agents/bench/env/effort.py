"""Size of a benchmark run."""

from __future__ import annotations

from dataclasses import dataclass

EPISODE = 600
"""[-] Steps of an episode, for us and the peers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Size of a run of `relpos bench env`."""

    envs: int = 64
    """[-] Environments of the figures with a peer and of the parts."""
    two_cores: tuple[int, ...] = (64, 256)
    """[-] Environments of two threads, one figure each; two processes have the first number
    each."""
    growth_envs: tuple[int, ...] = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
    """[-] Numbers of environments of the curve over environments, with three cars."""
    growth_cars: tuple[int, ...] = (2, 3, 5, 10, 20)
    """[-] Numbers of cars of the curve over cars, with `envs` environments."""
    turns: int = 10
    """[-] Number of turns, of which the best counts."""
    resets: int = 4
    """[-] Resets per turn, which determine its number of steps."""
    warm_up: int = 100
    """[-] Steps before the first turn, enough for the trackers to settle."""
    patience: float = 8.0
    """[s] Time after which a point of a curve starts no new turn."""


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
"""Short run of one to two minutes."""
