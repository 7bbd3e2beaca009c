"""Configuration of an environment: the arguments that all its forms share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from relpos_env.core.tracked_world import Trackers, default_params
from relpos_env.errors import EnvError, UnknownArgument
from relpos_env.interface.actions import ActionMode, action_mode
from relpos_env.interface.observations import ModeBuilder, ObservationMode, observation_mode
from relpos_env.interface.rangefinders import MAX_RANGEFINDERS
from relpos_env.registry import look_up
from relpos_env.rewards import REWARDS
from relpos_env.scenarios import Scenario
from relpos_env.scenarios import scenario as find_scenario
from relpos_env.sensors.operator import OperatorSimParams
from relpos_env.tasks import Task, TaskBuilder, make_task, reward_weights, task_builder
from relpos_env.tasks.needs import DEFAULT_SCENARIO, needs_of
from relpos_env.world.world import Physics
from tracking.arrays import F64
from tracking.errors import ConfigError
from tracking.filters import DEFAULT_FILTER, FilterBuilder, filter_builder
from tracking.tracker import TrackerParams

MOST_CARS = 20
KINDS: dict[str, tuple[type, ...]] = {
    "task_options": (Mapping,),
    "params": (TrackerParams, type(None)),
    "operator": (OperatorSimParams,),
    "weights": (Mapping, type(None)),
    "end_on_collision": (bool,),
    "gate": (bool,),
}
"""Types of arguments that are neither names nor numbers."""


RewardTerm = Callable[[Any], F64]
"""Function of the `relpos_env.core.env_core.EnvCore` after a step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FormationConfig:
    """Configuration of one environment with any interface."""

    scenario: str | Path | Scenario | None = None
    """Room, obstacles, sensors and randomisation: a name in `relpos_env.scenarios.SCENARIOS`, a
    TOML file, or a scenario; by default that of the task in
    `relpos_env.tasks.needs.DEFAULT_SCENARIO`."""
    task: str | TaskBuilder = "ring"
    """Task of the cars: one of `relpos_env.tasks.TASKS`, or
    [your own](../how-to/adding.md#your-own-without-a-change-here)."""
    task_options: Mapping[str, Any] = field(default_factory=dict)
    """The task's own options, by name."""
    n_cars: int | None = None
    """Number of car slots, 2 to 20; by default the largest number of cars of the scenario."""
    level: int | str | None = None
    """Level of the randomisation in place of the scenario's own: 0 to 4, or `easy` (1), `medium`,
    `hard`, `expert` (4)."""
    observation: str | ModeBuilder = "estimate"
    """Observation mode: one of `relpos_env.interface.observations.OBSERVATIONS`, or your own."""
    history: int = 1
    """Number of stacked observations, the newest first."""
    proximity: int = 0
    """Number of distance sensors of each car, 0 to 32; their readings are appended to the
    observation."""
    actions: str | Callable[[], ActionMode] = "continuous"
    """Action mode: one of `relpos_env.interface.actions.ACTIONS`, or your own."""
    filter: str | FilterBuilder = DEFAULT_FILTER
    """Position filter of the trackers: one of `tracking.filters.FILTERS`, or your own."""
    trackers: Trackers = "group"
    """``group``: one tracker receives the raw inertial samples of all cars, like a host that
    listens; ``own``: every car has its own, which knows what the others send in their ranging
    messages."""
    params: TrackerParams | None = None
    """Parameters of the tracker; by default `relpos_env.core.tracked_world.default_params`."""
    operator: OperatorSimParams = field(default_factory=OperatorSimParams)
    """Parameters of the simulated operator who commands the group."""
    weights: Mapping[str, float] | None = None
    """Weights of reward terms that differ from `relpos_env.tasks.DEFAULT_WEIGHTS`."""
    physics: Physics | None = None
    """``pymunk``: the cars move in a space that is kept for the episode, see
    `relpos_env.world.pymunk_space`; ``fast``: equal motion without contacts, for batches. The
    default is ``pymunk`` in the PettingZoo and Gymnasium environments, ``fast`` in vector forms."""
    reward: str | RewardTerm | None = None
    """Reward term that is added to those of the task, ``(formation) -> (env, car)``: your own, or
    ``information``, for certain estimates; infos contain it as ``reward_own``."""
    gate: bool = False
    """True to apply the safety gate of real cars, `hardware_bridge.safety.gate`, to all commands;
    infos contain the allowed commands and the reasons."""
    max_cycles: int = 600
    """Steps of 0.1 s until truncation."""
    end_on_collision: bool = False
    """True to terminate the episode at a contact."""

    def resolve(self) -> Parts:
        """Look up all names and check all values.

        Raises:
            EnvError: A name is unknown or a number out of range; the message names the argument.
        """
        config = replace(
            self,
            max_cycles=whole_number("max_cycles", self.max_cycles, 1, 800_000),
            history=whole_number("history", self.history, 1, 64),
            proximity=whole_number("proximity", self.proximity, 0, MAX_RANGEFINDERS),
        )
        if self.physics not in (None, *get_args(Physics)):
            raise EnvError(f"physics: expected pymunk or fast, got {self.physics!r}")
        if self.trackers not in get_args(Trackers):
            raise EnvError(f"trackers: expected group or own, got {self.trackers!r}")
        for name, kinds in KINDS.items():
            if not isinstance(getattr(self, name), kinds):
                expected = " or ".join("None" if k is type(None) else k.__name__ for k in kinds)
                raise EnvError(f"{name}: expected {expected}, got {getattr(self, name)!r}")
        try:
            filter_builder(self.filter)
        except ConfigError as error:
            raise EnvError(str(error)) from error
        task_builder(self.task)
        ours = self.task if isinstance(self.task, str) else ""
        name = DEFAULT_SCENARIO.get(ours, "ring-nlos")
        requested = name if self.scenario is None else self.scenario
        if not isinstance(requested, str | Path | Scenario):
            raise EnvError(f"scenario: expected a name, a path or a scenario, got {requested!r}")
        scenario = find_scenario(requested)
        if self.level is not None:
            scenario = scenario.at_level(self.level)
        n_cars = self.n_cars
        if n_cars is None:
            n_cars = scenario.most_cars
        else:
            n_cars = whole_number("n_cars", n_cars, 2, MOST_CARS)
            scenario = scenario.with_cars(n_cars)
        options = {**needs_of(self.task, scenario), **self.task_options}
        task = make_task(self.task, n_cars, 1, scenario.room, **options)
        reward_weights(self.task, task, self.weights)
        return Parts(
            config=config,
            scenario=scenario,
            n_cars=n_cars,
            task_options=options,
            reward=None
            if self.reward is None
            else look_up(REWARDS, self.reward, "reward", group="relpos_env.rewards"),
            mode=observation_mode(self.observation, n_cars, config.proximity),
            actions=action_mode(self.actions),
            params=default_params(scenario, n_cars, self.trackers)
            if self.params is None
            else self.params,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Configuration with its names looked up."""

    config: FormationConfig
    scenario: Scenario
    n_cars: int
    task_options: Mapping[str, Any]
    mode: ObservationMode
    actions: ActionMode
    params: TrackerParams
    reward: RewardTerm | None

    def make_task(self, n_envs: int) -> Task:
        """Return the task of a batch."""
        return make_task(
            self.config.task, self.n_cars, n_envs, self.scenario.room, **self.task_options
        )


def configure(arguments: Mapping[str, Any]) -> Parts:
    """Return the parts of a configuration from keyword arguments.

    Raises:
        EnvError: An argument or a name is unknown, or a number out of range.
    """
    known = [f.name for f in fields(FormationConfig)]
    for name in arguments:
        if name not in known:
            raise UnknownArgument(
                f"unexpected keyword argument {name!r}, expected one of {', '.join(known)}"
            )
    return FormationConfig(**arguments).resolve()


def whole_number(name: str, value: Any, least: int, most: int) -> int:
    """Return the value, if it is a whole number in a range.

    Raises:
        EnvError: It is not; the message names the argument.
    """
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and least <= value <= most):
        raise EnvError(f"{name}: expected a whole number from {least} to {most}, got {value!r}")
    return int(value)
