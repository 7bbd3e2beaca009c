"""Training environments of several scenarios as one vector environment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from agents.policies.layout import Layout
from agents.policies.padding import Padding
from relpos_env.api.sb3_attributes import SharedAttributeVecEnv
from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.api.state_space import N_TRUTH
from relpos_env.interface.observations import space_of
from relpos_env.interface.observations.base import F32
from tracking.arrays import Bool


class MultiScenarioVecEnv(SharedAttributeVecEnv):
    """The agent slots of several `FormationVecEnv`, concatenated.

    Environments may have fewer cars than the policy has slots: their observations are padded as if
    the other cars were absent, and they have one agent slot per car.
    """

    def __init__(
        self,
        parts: Sequence[FormationVecEnv],
        layout: Layout,
        *,
        reward_scale: float = 1.0,
        threads: int = 1,
    ) -> None:
        """Join the environments.

        Args:
            parts: Environments of one observation mode and action space, all or none with truth.
            layout: Observation layout of the policy.
            reward_scale: Factor of the rewards [-].
            threads: Number of parts that are stepped concurrently.
        """
        self.parts = tuple(parts)
        self._reward_scale = np.float32(reward_scale)
        self._views = [_SlotView(layout, part) for part in self.parts]
        self._pool = ThreadPoolExecutor(threads)
        # Usually the slowest first: most agent slots, then later ones, whose rooms are larger.
        sizes = [(part.num_envs, k) for k, part in enumerate(self.parts)]
        self._longest_first = [k for _, k in sorted(sizes, reverse=True)]
        self._rng = np.random.default_rng(0)
        ends = np.cumsum([p.num_envs for p in parts])
        self._slots = [slice(int(e) - p.num_envs, int(e)) for e, p in zip(ends, parts, strict=True)]
        self.render_mode = None
        space = observation_space(layout, with_truth=parts[0].with_truth)
        super().__init__(int(ends[-1]), space, parts[0].action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the seed of the next reset, which also randomises the phases of the episodes.

        Environments then do not end simultaneously, wherever training is resumed.
        """
        if seed is not None:
            self._rng = np.random.default_rng(seed)
            for part in self.parts:
                part.seed(int(self._rng.integers(1 << 30)))
        return [seed] * self.num_envs

    def reweigh(self, weights: Mapping[str, float]) -> None:
        """Set reward weights by term from the next step on; others are those of the task."""
        for part in self.parts:
            part.reweigh(weights)

    def reset(self) -> F32:
        """Begin episodes in all environments; return the observations, (slot, size)."""
        seen = [view(part.reset()) for view, part in zip(self._views, self.parts, strict=True)]
        for part in self.parts:
            part.stagger(self._rng)
        observations: F32 = np.concatenate(seen)
        return observations

    def step_async(self, actions: F32) -> None:
        """Set the actions of all agent slots."""
        for part, slots in zip(self.parts, self._slots, strict=True):
            part.step_async(actions[slots])

    def step_wait(self) -> tuple[F32, F32, Bool, list[dict[str, Any]]]:
        """Run one control step in all environments."""
        jobs = {k: self._pool.submit(self._step, k) for k in self._longest_first}
        seen, rewards, dones, infos = zip(
            *(jobs[k].result() for k in range(len(self.parts))), strict=True
        )
        all_infos = list(chain.from_iterable(infos))
        return np.concatenate(seen), np.concatenate(rewards), np.concatenate(dones), all_infos

    def _step(self, k: int) -> tuple[F32, F32, Bool, list[dict[str, Any]]]:
        """Run one control step in part k."""
        view = self._views[k]
        observations, reward, done, infos = self.parts[k].step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = view(info["terminal_observation"])
        return view(observations), reward * self._reward_scale, done, infos

    def close(self) -> None:
        """Release the threads."""
        self._pool.shutdown()
        for part in self.parts:
            part.close()


def observation_space(layout: Layout, *, with_truth: bool) -> Box:
    """Return the space of one agent slot: an observation, optionally followed by ground truth."""
    space = space_of(layout.fields, layout.history)
    more = np.full(N_TRUTH * layout.n_cars * with_truth, np.inf, np.float32)
    return Box(np.append(space.low, -more), np.append(space.high, more))


class _SlotView:
    """Observations of one part in the layout of the policy."""

    def __init__(self, layout: Layout, part: FormationVecEnv) -> None:
        given = replace(layout, n_cars=part.n_cars)
        self._pad, self._size = Padding(layout, given), given.size
        self._n_truth = N_TRUTH * layout.n_cars * part.with_truth

    def __call__(self, observations: F32) -> F32:
        """Return padded observations, (..., size)."""
        seen = self._pad(observations[..., : self._size])
        if not self._n_truth:
            return seen
        truth = np.zeros((*seen.shape[:-1], self._n_truth), np.float32)
        given = observations[..., self._size :]
        truth[..., : given.shape[-1]] = given
        return np.concatenate([seen, truth], axis=-1)
