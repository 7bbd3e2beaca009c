"""The figures of `relpos bench train`."""

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
from agents.training.ppo.learner import learn, make_model, run_leg

Row = dict[str, Any]
TURNS = 3
CASES: dict[str, tuple[str, ...]] = {
    "cars-nlos, 3 cars": ("cars-nlos",),
    "cars-nlos, swarm-nlos": ("cars-nlos", "swarm-nlos"),
}
"""What is trained in."""
PEERS = ("plain learner in nothing", "our learner in nothing")
"""What learns in an environment that costs nothing."""


def bench_train(
    *,
    updates: int = 6,
    threads: int = 2,
    after: int = 2,
    progress: Callable[[float], None] | None = None,
) -> list[Row]:
    """Frames per second of whole training, simulation and learning together.

    The peers learn in an environment that costs nothing, with the same networks, seats and batches:
    one without what makes ours fast (`make_plain`), so with the operations of torch and the
    optimiser of Stable-Baselines3 as they come, and ours. All learn from the observations of cars
    that are driven, so that equally many absent cars are left out.

    Args:
        updates: Of a turn.
        threads: Of simulation and learning.
        after: Updates before it is measured: cars that cannot drive yet push against walls and
            each other, which the simulation pays for.
        progress: Called with the share done, 0 to 1.
    """
    torch.set_num_threads(threads)
    rows: list[Row] = []
    for case, scenarios in CASES.items():
        config = TrainConfig(frames=10**9, threads=threads, leg=updates)
        config = replace(config, env=replace(config.env, scenarios=scenarios))
        rooms = make_rooms(config, None)
        ours = _quiet(make_model(config, rooms))
        # Compiles what is not, and puts the cars somewhere.
        run_leg(ours, replace(config, leg=after), 0)
        nothing = Nothing(rooms, rooms.reset())
        plain = _quiet(make_plain(make_model(config, nothing)))
        same = _quiet(make_model(config, nothing))
        for peer in (plain, same):
            run_leg(peer, replace(config, leg=1), 0)
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
    """Updates in the middle of a leg; their time for a frame [us]."""
    env: VecEnv = model.env

    def turn() -> float:
        start = time.perf_counter()
        learn(model, config)
        frames = config.leg * config.ppo.steps * env.num_envs
        return 1e6 * (time.perf_counter() - start) / float(frames)

    return turn
