"""PPO of Stable-Baselines3, configured for a swarm."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import set_random_seed

from agents.training.config import TrainConfig
from agents.training.environments import layout_of, weights_of
from agents.training.ppo.buffer import SwarmRolloutBuffer
from agents.training.ppo.hyperbolic import Tanh
from agents.training.ppo.network import Actor, SwarmPolicy
from agents.training.rooms import MultiScenarioVecEnv, observation_space
from relpos_env.api.state_space import N_TRUTH
from relpos_env.interface.actions import ContinuousActions

CRITIC_ALONE = 0.1
"""[-] Share of a run with an initial policy in which only the critic is trained: the errors of an
untrained critic would degrade that policy."""
FALL = (0.5, 0.7)
"""[-] Shares of the run between which the upper limit of the action noise falls."""


def level_of(config: TrainConfig, frames: int) -> int | None:
    """Return the curriculum level after `frames` agent steps; None for that of the scenarios."""
    levels = config.env.levels
    return levels[min(frames * len(levels) // config.frames, len(levels) - 1)] if levels else None


def share_done(config: TrainConfig, frames: int) -> float:
    """Return the completed share of the run; Stable-Baselines3 reports that of `learn` only."""
    return min(frames / config.frames, 1.0)


def make_model(config: TrainConfig, rooms: MultiScenarioVecEnv) -> PPO:
    """Return the learner with random weights, determined by the seed."""
    ppo = config.ppo
    models: list[PPO] = []

    def learning_rate(_: float) -> float:
        share = share_done(config, models[0].num_timesteps) if models else 0.0
        return ppo.learning_rate * (0.01 + 0.495 * (1.0 + math.cos(math.pi * share)))

    with warnings.catch_warnings():
        # Batches that do not divide the experience: `SwarmRolloutBuffer` drops the remainder.
        warnings.filterwarnings("ignore", message="You have specified a mini-batch size")
        model = PPO(
            SwarmPolicy,
            rooms,
            n_steps=ppo.steps,
            batch_size=min(ppo.batch, ppo.steps * rooms.num_envs),
            n_epochs=ppo.epochs,
            learning_rate=learning_rate,
            gamma=ppo.gamma,
            gae_lambda=ppo.gae_lambda,
            clip_range=ppo.clip,
            ent_coef=ppo.entropy,
            rollout_buffer_class=SwarmRolloutBuffer,
            policy_kwargs=network_arguments(config),
            seed=config.seed,
            device="cpu",
        )
    models.append(model)
    return model


def network_arguments(config: TrainConfig) -> dict[str, Any]:
    """Return the arguments of `SwarmPolicy` except its spaces."""
    net = config.net
    return {
        "features": {
            "fields": layout_of(config).fields,
            "history": config.env.history,
            "width": net.width,
            "depth": net.depth,
        },
        "n_state": N_TRUTH * config.env.cars if net.critic == "central" else 0,
        "net_arch": [net.width] * net.layers,
        "activation_fn": Tanh,
        # Default of Stable-Baselines3, fused into one pass over all weights.
        "optimizer_kwargs": {"eps": 1e-5, "fused": True},
        "log_std_init": net.log_std,
    }


def make_policy(config: TrainConfig) -> SwarmPolicy:
    """Return the networks without a learner, for trained weights."""
    arguments = network_arguments(config)
    space = observation_space(layout_of(config), with_truth=config.net.critic == "central")
    return SwarmPolicy(space, ContinuousActions().space(), lambda _: 0.0, **arguments)


def run_interval(
    model: PPO, config: TrainConfig, interval: int, tell: Callable[[int], None] | None = None
) -> None:
    """Train for one evaluation interval, beginning with new episodes.

    Args:
        model: Learner.
        config: Configuration of the run.
        interval: Index of the evaluation interval.
        tell: Called with the agent steps of the run so far, after every rollout.
    """
    seeds = np.random.SeedSequence([config.seed, interval]).generate_state(2)
    set_random_seed(int(seeds[0] >> 1))
    model.env.seed(int(seeds[1] >> 1))
    # Without a last observation, `learn` begins with a reset.
    model._last_obs = None
    learn(model, config, tell)


def learn(model: PPO, config: TrainConfig, tell: Callable[[int], None] | None = None) -> None:
    """Train for one evaluation interval without resetting the episodes; see `run_interval`."""
    frames = config.eval_interval * config.ppo.steps * model.n_envs
    # The last interval ends with the run, after whole updates.
    frames = min(frames, max(config.frames - model.num_timesteps, 1))
    callbacks: list[BaseCallback] = [_Threads(config.threads), _Noise(config)]
    if tell is not None:
        callbacks.append(_Tells(tell))
    if config.env.final_weights:
        callbacks.append(_Weights(config))
    if config.begin:
        callbacks.append(_CriticAlone(config))
    model.learn(frames, callbacks, reset_num_timesteps=False, log_interval=config.eval_interval)


class _Tells(BaseCallback):  # type: ignore[misc]
    """Reports the progress of training."""

    def __init__(self, tell: Callable[[int], None]) -> None:
        super().__init__()
        self._tell = tell

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self._tell(int(self.num_timesteps))


class _Threads(BaseCallback):  # type: ignore[misc]
    """Uses all threads of torch for updates, and one during rollouts.

    Batches are small during rollouts, and idle worker threads of torch spin for a while on cores
    that the simulation needs.
    """

    def __init__(self, threads: int) -> None:
        super().__init__()
        self._most = threads

    def _on_rollout_start(self) -> None:
        torch.set_num_threads(1)

    def _on_rollout_end(self) -> None:
        torch.set_num_threads(self._most)

    def _on_step(self) -> bool:
        return True


class _Noise(BaseCallback):  # type: ignore[misc]
    """Limits the standard deviation of actions; the limit decreases during the run.

    Without a limit, the noise stays at 0.2 to 0.3 of the largest speed and steering, and policies
    depend on it: the most likely action leaves the car at rest in places where noise would move
    it. Less noise from the start slows training down.
    """

    def __init__(self, config: TrainConfig) -> None:
        super().__init__()
        self._config = config

    def _on_rollout_start(self) -> None:
        net = self._config.net
        done = share_done(self._config, self.model.num_timesteps)
        fallen = min(max((done - FALL[0]) / (FALL[1] - FALL[0]), 0.0), 1.0)
        if fallen > 0.0:
            with torch.no_grad():
                most = net.log_std + fallen * (net.final_log_std - net.log_std)
                self.model.policy.log_std.clamp_(max=most)

    def _on_step(self) -> bool:
        return True


class _CriticAlone(BaseCallback):  # type: ignore[misc]
    """Freezes the actor until the critic has been trained on the initial policy."""

    def __init__(self, config: TrainConfig) -> None:
        super().__init__()
        self._config = config

    def _on_rollout_start(self) -> None:
        learns = share_done(self._config, self.model.num_timesteps) >= CRITIC_ALONE
        policy = self.model.policy
        for weight in (*Actor(policy).parameters(), policy.log_std):
            weight.requires_grad_(learns)
            weight.grad = None

    def _on_step(self) -> bool:
        return True


class _Weights(BaseCallback):  # type: ignore[misc]
    """Changes the reward weights to their final values during the run."""

    def __init__(self, config: TrainConfig) -> None:
        super().__init__()
        self._config = config

    def _on_rollout_start(self) -> None:
        done = share_done(self._config, self.model.num_timesteps)
        self.model.env.reweigh(weights_of(self._config, done))

    def _on_step(self) -> bool:
        return True
