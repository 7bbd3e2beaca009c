"""Figures of `relpos bench train`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv

from agents.bench.env.turns import best_of_turns
from agents.bench.train.nothing import Nothing
from agents.bench.train.plain import make_plain
from agents.training.config import TrainConfig
from agents.training.environments import make_rooms
from agents.training.ppo.learner import learn, make_model, run_interval

Row = dict[str, Any]
TURNS = 3
CASES: dict[str, tuple[str, ...]] = {
    "cars-nlos, 3 cars": ("cars-nlos",),
    "cars-nlos, swarm-nlos": ("cars-nlos", "swarm-nlos"),
}
"""Training scenarios by case."""
PEERS = ("plain learner in nothing", "our learner in nothing")
"""Peers that train in an environment without cost."""


def bench_train(
    *,
    updates: int = 6,
    threads: int = 2,
    after: int = 2,
    progress: Callable[[float], None] | None = None,
) -> list[Row]:
    """Measure agent steps per second of training, simulation and learning together.

    The peers train in an environment without cost, with the same networks, agent slots and batches:
    one learner without our optimisations (`make_plain`), and ours. All train on observations of
    driven cars, so that the share of absent cars is the same.

    Args:
        updates: Updates per turn.
        threads: Threads of simulation and learning.
        after: Updates before the timing: untrained cars push against walls and each other, which
            slows the simulation down.
        progress: Called with the share done, 0 to 1.
    """
    torch.set_num_threads(threads)
    rows: list[Row] = []
    for case, scenarios in CASES.items():
        config = TrainConfig(frames=10**9, threads=threads, eval_interval=updates)
        config = replace(config, env=replace(config.env, scenarios=scenarios))
        rooms = make_rooms(config, None)
        ours = _quiet(make_model(config, rooms))
        # Compiles the kernels, and drives the cars away from their initial positions.
        run_interval(ours, replace(config, eval_interval=after), 0)
        nothing = Nothing(rooms, rooms.reset())
        plain = _quiet(make_plain(make_model(config, nothing)))
        same = _quiet(make_model(config, nothing))
        for peer in (plain, same):
            run_interval(peer, replace(config, eval_interval=1), 0)
        turns = [_turn(model, config) for model in (ours, plain, same)]
        us, *peers_us = best_of_turns(turns, TURNS)
        rooms.close()
        for peer_name, peer_us in zip(PEERS, peers_us, strict=True):
            rows.append(
                {
                    "case": case,
                    "value": 1e6 / us,
                    "unit": "frames/s",
                    "peer": peer_name,
                    "peer_value": 1e6 / peer_us,
                    "ratio": peer_us / us,
                    "threads": threads,
                    "after_frames": after * config.ppo.steps * rooms.num_envs,
                    "us_per_frame": us,
                }
            )
        if progress is not None:
            progress(len(rows) / len(CASES) / len(PEERS))
    return rows


def _quiet(model: PPO) -> PPO:
    model.set_logger(Logger(None, []))
    return model


def _turn(model: PPO, config: TrainConfig) -> Callable[[], float]:
    """Return a function that measures the time per agent step over an interval [us]."""
    env: VecEnv = model.env

    def turn() -> float:
        start = time.perf_counter()
        learn(model, config)
        frames = config.eval_interval * config.ppo.steps * env.num_envs
        return 1e6 * (time.perf_counter() - start) / float(frames)

    return turn
