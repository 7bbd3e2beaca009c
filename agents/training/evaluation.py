"""Evaluation of a policy in training, on the same episodes after every evaluation interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from gymnasium.utils import seeding

from agents.policies.layout import Layout
from agents.policies.padding import Padding
from agents.simulation.demo import SETTLE
from agents.training.environments import shares
from agents.training.ppo.network import Actor, SwarmPolicy
from relpos_env.config import Parts
from relpos_env.core.env_core import EnvCore
from relpos_env.interface.observations.base import F32
from relpos_env.timing import DECISION
from tracking.arrays import F64, Bool

FIRST_SEED = 500
"""First seed of the evaluation episodes, at most 500: comparisons begin at seed 1000."""


class Evaluation:
    """Episodes of all scenarios, driven by the most likely actions of a policy."""

    def __init__(
        self,
        every: Sequence[Parts],
        layout: Layout,
        episodes: int,
        threads: int,
        *,
        first_seed: int = FIRST_SEED,
    ) -> None:
        """Allocate the environments.

        Args:
            every: Parts of the environments of each scenario.
            layout: Observation layout of the policy.
            episodes: Number of episodes, divided among the scenarios.
            threads: Threads of the simulation.
            first_seed: Seed of the first episode.
        """
        self._first_seed = first_seed
        self._rooms = [
            _Room(EnvCore(parts, n, min(threads, n)), Padding(layout, Layout.of(parts)))
            for parts, n in zip(every, shares(episodes, len(every)), strict=True)
        ]

    def run(self, policy: SwarmPolicy) -> dict[str, Any]:
        """Return the mean reward per agent step, errors from `SETTLE` on [m], and collisions.

        Means are over cars and times, so scenarios with more cars have more weight. Steps after an
        early end have zero reward: finishing early is optimal where time has a cost. The tracking
        error is None if no car had a usable estimate.
        """
        actor = Actor(policy).eval()
        first, drives = self._first_seed, []
        for room in self._rooms:
            drives.append(room.drive(actor, first))
            first += room.formation.n_envs
        rewards, decisions, collisions, minutes = (
            sum(getattr(d, name) for d in drives)
            for name in ("rewards", "decisions", "collisions", "minutes")
        )
        tracking = np.concatenate([d.tracking for d in drives])
        return {
            "return": rewards / max(decisions, 1.0),
            "formation_error": float(np.concatenate([d.error for d in drives]).mean()),
            "tracking_error": float(tracking.mean()) if tracking.size else None,
            "collisions_per_min": collisions / minutes,
        }

    def close(self) -> None:
        """Release the threads."""
        for room in self._rooms:
            room.formation.close()


@dataclass(frozen=True, slots=True)
class _Drive:
    """Results of the episodes of one scenario."""

    rewards: float
    """Sum over all cars and control steps."""
    decisions: float
    """Number of agent steps, those after an early end included."""
    collisions: float
    minutes: float
    error: F64
    """[m] Formation errors from `SETTLE` on, of all cars and times."""
    tracking: F64
    """[m] Finite tracking errors from `SETTLE` on, of all cars and times."""


@dataclass(frozen=True, slots=True)
class _Room:
    """Parallel episodes of one scenario."""

    formation: EnvCore
    pad: Padding

    def drive(self, actor: Actor, first_seed: int) -> _Drive:
        """Run all episodes to their end."""
        f = self.formation
        for env in range(f.n_envs):
            f.seed(env, seeding.np_random(first_seed + env)[0])
            f.begin([env])
        error, tracking, present, going = [], [], [], []
        collisions, rewards, decisions = 0.0, 0.0, 0.0
        on = np.ones(f.n_envs, dtype=bool)
        for _ in range(f.parts.config.max_cycles - 1):
            going.append(on)
            f.step(*f.parts.actions.decode(drive(actor, self.pad(f.observations)), "actions"))
            error.append(f.task.error.copy())
            tracking.append(f.tracking_error())
            present.append(f.state.present & on[:, None])
            decisions += float(f.state.present.sum())
            collisions += float(f.loop.swarm.contacts[on].sum())
            rewards += float(f.rewards[on].sum())
            on = on & ~f.task.done
        alive, here = np.array(going), np.array(present)
        scored = here & _scored(alive)[..., None]
        known = np.array(tracking)[scored]
        return _Drive(
            rewards=rewards,
            decisions=decisions,
            collisions=collisions,
            minutes=float(alive.sum()) * DECISION / 60.0,
            error=np.array(error)[scored],
            tracking=known[np.isfinite(known)],
        )


def _scored(alive: Bool) -> Bool:
    """Return the control steps that are scored: from `SETTLE` on, or the last of an earlier end.

    Args:
        alive: True until the end of the episode, (step, env).
    """
    scored = alive.copy()
    scored[: round(SETTLE / DECISION)] = False
    early = np.flatnonzero(~scored.any(axis=0))
    scored[alive[:, early].sum(axis=0) - 1, early] = True
    return scored


def drive(actor: Actor, observations: F32) -> F32:
    """Return actions for observations with any leading axes, (..., 2)."""
    with torch.no_grad():
        flat = torch.from_numpy(observations.reshape(-1, observations.shape[-1]))
        actions: F32 = actor(flat).numpy()
    return actions.reshape(*observations.shape[:-1], -1)
