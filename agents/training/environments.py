"""The environments of a run: those it learns in and those that tell how good it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from agents.errors import UsageError
from agents.policies.layout import Layout
from agents.training.config import MOST_SEED, TrainConfig
from agents.training.rooms import MultiScenarioVecEnv
from relpos_env.api.sb3_vec_env import FormationVecEnv
from relpos_env.config import FormationConfig, Parts
from relpos_env.sensors.operator import OperatorSimParams
from relpos_env.tasks import DEFAULT_WEIGHTS
from relpos_env.timing import DECISION

CHANGE = (0.25, 0.5)
"""[-] Shares of the run between which weights of reward terms go to their final values."""


def layout_of(config: TrainConfig) -> Layout:
    """What the policy sees."""
    env = config.env
    return Layout(env.observation, env.cars, env.history, env.proximity)


def env_arguments(
    config: TrainConfig, scenario: str, level: int | None, done: float = 1.0
) -> dict[str, Any]:
    """Arguments of the environments of one scenario, with as many slots as it has cars.

    Args:
        config: Of the run.
        scenario: Name or TOML file.
        level: Of the curriculum; None for what the scenario says.
        done: Share of the run, on which the weights of reward terms depend.
    """
    env = config.env
    return {
        "scenario": Path(scenario) if scenario.endswith(".toml") else scenario,
        "task": env.task,
        "level": level,
        "observation": env.observation,
        "history": env.history,
        "weights": weights_of(config, done),
        "proximity": env.proximity,
        "operator": OperatorSimParams(share=env.operator),
        "max_cycles": round(env.seconds / DECISION),
    }


def weights_of(config: TrainConfig, done: float) -> dict[str, float]:
    """Weights of reward terms by name when such a share of the run is done.

    Raises:
        UsageError: One is not TERM=WEIGHT.
    """
    env = config.env
    first, final = _weights("weight", env.weights), _weights("final-weight", env.final_weights)
    known = DEFAULT_WEIGHTS.get(env.task, {})
    gone = min(max((done - CHANGE[0]) / (CHANGE[1] - CHANGE[0]), 0.0), 1.0)
    moving = {
        term: (1.0 - gone) * first.get(term, known.get(term, 0.0)) + gone * weight
        for term, weight in final.items()
    }
    return first | moving


def _weights(option: str, given: tuple[str, ...]) -> dict[str, float]:
    """Weights by term.

    Raises:
        UsageError: One is not TERM=WEIGHT.
    """
    weights = {}
    for text in given:
        term, _, weight = text.partition("=")
        try:
            weights[term] = float(weight)
        except ValueError as error:
            raise UsageError(f"--{option}: expected TERM=WEIGHT, got {text!r}") from error
    return weights


def check_environments(config: TrainConfig) -> tuple[Parts, ...]:
    """See that all environments of a run can be, at every level; those it learns in.

    Returns:
        What they are made of, as the scenarios say.

    Raises:
        UsageError: More cars than the policy has slots for, or no scenario at all.
        EnvError: An environment that cannot be.
    """
    if config.seed + config.runs - 1 > MOST_SEED:
        raise UsageError(
            f"--seed: expected at most {MOST_SEED - config.runs + 1} with {config.runs} runs, "
            f"got {config.seed}"
        )
    names, others = config.env.scenarios, config.choice_scenarios
    if not names:
        raise UsageError("--scenario: expected at least one")
    known = [name for name in others if name in names]
    if known:
        raise UsageError(
            f"--choice-scenario: expected scenarios that are not learned in, got {known[0]!r}"
        )
    for option, given, needed in (
        ("envs", config.ppo.envs, len(names)),
        ("eval-episodes", config.eval_episodes, len(names)),
        ("choice-episodes", config.choice_episodes, len(names) + len(others)),
    ):
        if given < needed:
            raise UsageError(
                f"--{option}: expected at least {needed}, one for each scenario, got {given}"
            )
    every = [_parts(config, name, level) for name in names for level in config.env.levels]
    learned = [_parts(config, name, None) for name in names]
    most = max(p.n_cars for p in (*every, *learned, *choice_environments(config)))
    if most > config.env.cars:
        raise UsageError(
            f"--cars: expected at least {most}, the cars of the scenarios, got {config.env.cars}"
        )
    return tuple(learned)


def choice_environments(config: TrainConfig) -> tuple[Parts, ...]:
    """Those that tell which policy is kept: learned in, and new to it.

    Raises:
        EnvError: An environment that cannot be.
    """
    names = (*config.env.scenarios, *config.choice_scenarios)
    return tuple(_parts(config, name, None) for name in names)


def _parts(config: TrainConfig, scenario: str, level: int | None) -> Parts:
    return FormationConfig(**env_arguments(config, scenario, level)).resolve()


def shares(n: int, scenarios: int) -> list[int]:
    """So many environments or episodes of each scenario."""
    counts: list[int] = np.diff(np.linspace(0, n, scenarios + 1).astype(int)).tolist()
    return counts


def make_rooms(config: TrainConfig, level: int | None) -> MultiScenarioVecEnv:
    """The environments to learn in at a level of the curriculum."""
    scenarios = config.env.scenarios
    # Handing work to a thread costs as much as stepping a few environments: rather whole rooms.
    whole = len(scenarios) >= config.threads
    parts = [
        FormationVecEnv(
            n,
            threads=1 if whole else min(config.threads, n),
            with_truth=config.net.critic == "central",
            **env_arguments(config, scenario, level, done=0.0),
        )
        for scenario, n in zip(scenarios, shares(config.ppo.envs, len(scenarios)), strict=True)
    ]
    return MultiScenarioVecEnv(
        parts,
        layout_of(config),
        reward_scale=config.ppo.reward_scale,
        threads=config.threads if whole else 1,
    )
