"""Training and evaluation environments of a run."""

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
"""[-] Shares of the run between which the reward weights change to their final values."""


def layout_of(config: TrainConfig) -> Layout:
    """Return the observation layout of the policy."""
    env = config.env
    return Layout(env.observation, env.cars, env.history, env.proximity)


def env_arguments(
    config: TrainConfig, scenario: str, level: int | None, done: float = 1.0
) -> dict[str, Any]:
    """Return the arguments of the environments of one scenario, with one slot per car.

    Args:
        config: Configuration of the run.
        scenario: Name or TOML file.
        level: Curriculum level; None for the level of the scenario.
        done: Completed share of the run, which determines the reward weights [-].
    """
    env = config.env
    return {
        "scenario": Path(scenario) if scenario.endswith(".toml") else scenario,
        "task": env.task,
        "level": level,
        "trackers": env.trackers,
        "observation": env.observation,
        "history": env.history,
        "weights": weights_of(config, done),
        "proximity": env.proximity,
        "operator": OperatorSimParams(share=env.operator),
        "max_cycles": round(env.seconds / DECISION),
    }


def weights_of(config: TrainConfig, done: float) -> dict[str, float]:
    """Return the weights of reward terms by name after the share `done` of the run.

    Raises:
        UsageError: A weight is not TERM=WEIGHT.
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
    """Return weights by term.

    Raises:
        UsageError: A text is not TERM=WEIGHT.
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
    """Validate all environments of a run, at every curriculum level.

    Returns:
        Parts of the training environments, at the levels of the scenarios.

    Raises:
        UsageError: An option does not fit the others, for example too few slots for the cars.
        EnvError: An environment is invalid.
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
    """Return the environments of model selection: of training and held-out scenarios.

    Raises:
        EnvError: An environment is invalid.
    """
    names = (*config.env.scenarios, *config.choice_scenarios)
    return tuple(_parts(config, name, None) for name in names)


def _parts(config: TrainConfig, scenario: str, level: int | None) -> Parts:
    return FormationConfig(**env_arguments(config, scenario, level)).resolve()


def shares(n: int, scenarios: int) -> list[int]:
    """Return the numbers of environments or episodes per scenario; their sum is `n`."""
    counts: list[int] = np.diff(np.linspace(0, n, scenarios + 1).astype(int)).tolist()
    return counts


def make_rooms(config: TrainConfig, level: int | None) -> MultiScenarioVecEnv:
    """Return the training environments at a curriculum level."""
    scenarios = config.env.scenarios
    # Dispatching to a thread costs as much as stepping a few environments: one job per scenario.
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
