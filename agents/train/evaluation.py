"""How good a policy is that is being trained: the same episodes after every leg."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium.utils import seeding

from agents.demo import SETTLE
from agents.policy.layout import Layout
from agents.policy.padding import Padding
from agents.train.network import Actor, SwarmPolicy
from relpos_env.config import Parts
from relpos_env.formation import Formation
from relpos_env.interface.observations.base import F32
from relpos_env.timing import DECISION
from tracking.arrays import F64

FIRST_SEED = 500
"""Episodes of an evaluation have seeds from here on, in training and comparing never used."""


class Evaluation:
    """Episodes side by side, driven by what a policy holds for best."""

    def __init__(self, parts: Parts, layout: Layout, episodes: int, threads: int) -> None:
        """Make room for them.

        Args:
            parts: What the environments are made of.
            layout: What the policy sees.
            episodes: How many.
            threads: Of the simulation.
        """
        self._formation = Formation(parts, episodes, min(threads, episodes))
        self._pad = Padding(layout, Layout.of(parts))
        self._steps = parts.config.max_cycles - 1

    def run(self, policy: SwarmPolicy) -> dict[str, Any]:
        """Mean return of a decision, errors from `SETTLE` on [m], and contacts.

        The tracking error is None where nobody could use any estimate.
        """
        f = self._formation
        for env in range(f.n_envs):
            f.seed(env, seeding.np_random(FIRST_SEED + env)[0])
            f.begin(env)
        actor = Actor(policy).eval()
        error, tracking, present, contacts, rewards = [], [], [], 0.0, 0.0
        for _ in range(self._steps):
            f.step(*f.parts.actions.decode(drive(actor, self._pad(f.observations)), "actions"))
            error.append(f.task.error.copy())
            tracking.append(f.tracking_error())
            present.append(f.state.present.copy())
            contacts += float(f.loop.swarm.contacts.sum())
            rewards += float(f.rewards.sum())
        here, settled = np.array(present), round(SETTLE / DECISION)
        minutes = f.n_envs * self._steps * DECISION / 60.0
        return {
            "return": rewards / max(float(here.sum()), 1.0),
            "formation_error": float(np.array(error)[settled:][here[settled:]].mean()),
            "tracking_error": _mean(np.array(tracking)[settled:]),
            "collisions_per_min": contacts / minutes,
        }

    def close(self) -> None:
        """Release the threads."""
        self._formation.close()


def _mean(values: F64) -> float | None:
    found = values[np.isfinite(values)]
    return float(found.mean()) if found.size else None


def drive(actor: Actor, observations: F32) -> F32:
    """Actions for observations of any leading axes, (..., 2)."""
    with torch.no_grad():
        flat = torch.from_numpy(observations.reshape(-1, observations.shape[-1]))
        actions: F32 = actor(flat).numpy()
    return actions.reshape(*observations.shape[:-1], -1)
