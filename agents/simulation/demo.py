"""Simulate cars that keep a formation on estimates (`relpos demo`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.comparison.blindfold import Blindfold
from agents.controllers import build_controller
from agents.driver import Driver
from agents.errors import UsageError
from agents.evaluation.track import TrackResult, track_log
from agents.policies import Layout, TrainedPolicy, load_policy
from agents.simulation.frames import FrameRecorder, errors
from relpos_env import formation_v0
from relpos_env.api.parallel_env import FormationEnv
from relpos_env.core.tracked_world import Trackers
from relpos_env.timing import DECISION
from tracking.filters import DEFAULT_FILTER, FILTERS, filter_builder
from tracking.log.folder import Log
from tracking.params.short_repr import short_repr

INFORMATION = ("estimate", "truth", "nothing")
"""Information about other cars in each drive of a demonstration."""
CONTROLLER, TASK = "consensus", "ring"
"""Default controller and task."""
SETTLE = 10.0
"""[s] Start of the interval over which errors are averaged."""


@dataclass(frozen=True, slots=True)
class DemoResult:
    """Result of one demonstration."""

    __repr__ = short_repr

    scenario: str
    task: str
    driver: str
    """Name of the controller or policy."""
    seed: int
    seconds: float
    """[s] Length of the drive on estimates."""
    done: bool
    """True if the drive ended because the task was accomplished."""
    formation_error: float
    """[m] Formation error of the drive on estimates: mean distance of the others from their target
    positions, as defined by the task, see `relpos_env.tasks`."""
    formation_error_truth: float | None
    """[m] Formation error with true relative positions; None if the observations cannot hold
    them."""
    formation_error_blind: float
    """[m] Formation error without other cars, on the operator's command only."""
    nlos_share: float
    """[-] Share of NLOS ranges."""
    collisions: int
    """[-] Collisions of cars with each other, obstacles and walls."""
    tracks: tuple[TrackResult, ...]
    """Results of several filters on the drive."""
    frames: dict[str, Any]
    """Frames of the animation."""
    log: Log
    """Measurements and truth of the drive on estimates."""

    def tracked_by(self, filters: Sequence[str]) -> DemoResult:
        """Return the result with the drive tracked by other filters."""
        return replace(self, tracks=_track(self.log, filters))

    @property
    def summary(self) -> list[dict[str, Any]]:
        """JSON records, one per filter and one for the formation."""
        return [
            *({"result": "tracking", **r.summary} for r in self.tracks),
            {
                "result": "formation",
                "scenario": self.scenario,
                "task": self.task,
                "driver": self.driver,
                "seed": self.seed,
                "seconds": self.seconds,
                "done": self.done,
                "formation_error": self.formation_error,
                "formation_error_truth": self.formation_error_truth,
                "formation_error_blind": self.formation_error_blind,
                "nlos_share": self.nlos_share,
                "collisions": self.collisions,
            },
        ]


def demo(
    *,
    scenario: str | Path | None = None,
    task: str | None = None,
    seconds: float = 60.0,
    seed: int = 0,
    cars: int | None = None,
    proximity: int | None = None,
    controller: str | None = None,
    policy: str | Path | None = None,
    filter: str = DEFAULT_FILTER,
    trackers: Trackers = "group",
    filters: Sequence[str] = tuple(FILTERS),
    window: bool = False,
    film: Callable[[Any], None] | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Callable[[dict[str, Any], str], None] | None = None,
) -> DemoResult:
    """Drive a formation on estimates and, for comparison, on the truth and without other cars.

    Args:
        scenario: One of `relpos_env.scenarios.SCENARIOS` or a TOML file; by default the first one
            that the policy was trained in, or that of the task.
        task: One of `relpos_env.tasks.TASKS`; by default that of the policy, or `TASK`.
        seconds: Largest length [s]; the drive also ends when the task is done.
        seed: Seed; the same seed gives the same run.
        cars: Number of cars; by default that of the scenario.
        proximity: Distance sensors per car; by default those of the policy, or none.
        controller: One of `agents.controllers.CONTROLLERS`, by default `CONTROLLER`.
        policy: A trained policy, as for `load_policy`, in place of the controller.
        filter: Filter of the cars, one of `tracking.filters.FILTERS`.
        trackers: One tracker for the group, or one on each car.
        filters: Filters that track the recorded drive for comparison.
        window: Show the drive on estimates in a window; needs pygame.
        film: Called with a picture of the drive on estimates after every control step, uint8
            (height, width, 3), if there is no window; needs pygame.
        progress: Called with the share done, 0 to 1.
        watch: Called after every control step with the frames so far and an element of
            `INFORMATION`.

    Raises:
        ConfigError: No such filter.
        EnvError: An unknown name or a number out of range.
        UsageError: A controller and a policy are given, or the policy cannot be loaded or does not
            fit these cars.
    """
    if policy is not None and controller is not None:
        raise UsageError("policy: expected either a policy or a controller, got both")
    trained = None if policy is None else load_policy(policy)
    controller = controller or CONTROLLER
    trained_task, trained_scenario = _trained_for(trained)
    task = task or trained_task or TASK
    if scenario is None and task == trained_task:
        scenario = trained_scenario
    filter_builder(filter)
    drives: dict[str, Drive] = {}
    render = "human" if window else None if film is None else "rgb_array"
    modes, history = _modes(trained), 1 if trained is None else trained.layout.history
    if trained is not None:
        if proximity not in (None, trained.layout.proximity):
            raise UsageError(
                f"proximity: expected {trained.layout.proximity}, the distance sensors of the "
                f"policy, got {proximity}"
            )
        proximity = trained.layout.proximity
    for n, (information, mode) in enumerate(modes.items()):

        def tell(share: float, n: int = n) -> None:
            if progress is not None:
                progress((n + share) / len(modes))

        def show(frames: dict[str, Any], information: str = information) -> None:
            if watch is not None:
                watch(frames, information)

        env = formation_v0.parallel_env(
            scenario=scenario,
            task=task,
            n_cars=cars,
            observation=mode,
            history=history,
            proximity=proximity or 0,
            max_cycles=round(seconds / DECISION),
            record=information == "estimate",
            filter=filter,
            trackers=trackers,
            render_mode=render if information == "estimate" else None,
        )
        driver: Driver
        if trained is None:
            driver = build_controller(controller, env.fields)
        else:
            driver = trained.driver(Layout(mode, len(env.possible_agents), history, proximity or 0))
        drives[information] = drive(
            env, driver, seed, blind=information == "nothing", progress=tell, watch=show, film=film
        )
        if information == "estimate":
            name = env.scenario.name
            log = env.recorded_log(f"{name}-{seed}")
        env.close()
    ours = drives["estimate"]
    assert log.nlos is not None
    return DemoResult(
        scenario=name,
        task=task,
        driver=controller if trained is None else trained.card.name,
        seed=seed,
        seconds=ours.seconds,
        done=ours.done,
        formation_error=ours.formation_error,
        formation_error_truth=drives["truth"].formation_error if "truth" in drives else None,
        formation_error_blind=drives["nothing"].formation_error,
        nlos_share=float(log.nlos.mean()) if len(log.nlos) else 0.0,
        collisions=ours.collisions,
        tracks=_track(log, filters),
        frames=ours.frames,
        log=log,
    )


def _track(log: Log, filters: Sequence[str]) -> tuple[TrackResult, ...]:
    """Return the drive tracked by some filters, without the checks for real sensors."""
    return tuple(track_log(log, filter=name, findings=()) for name in filters)


def _trained_for(policy: TrainedPolicy | None) -> tuple[str | None, str | None]:
    """Return task and scenario of a policy's training; None if its card does not name them."""
    training = {} if policy is None else policy.card.training
    task, scenario = training.get("task"), training.get("scenario")
    return None if task is None else str(task), None if scenario is None else str(scenario)


def _modes(policy: TrainedPolicy | None) -> dict[str, str]:
    """Return the observation mode of each drive, by element of `INFORMATION`."""
    modes = {
        information: "truth" if information == "truth" else "estimate"
        for information in INFORMATION
    }
    if policy is not None and policy.layout.observation not in modes.values():
        # The observations of this policy are measurements, without a true counterpart.
        del modes["truth"]
        return dict.fromkeys(modes, policy.layout.observation)
    return modes


@dataclass(frozen=True, slots=True)
class Drive:
    """Result of one episode."""

    seconds: float
    done: bool
    """True if the episode ended because the task was accomplished."""
    formation_error: float
    """[m] Mean formation error from `SETTLE` on, or the last error of a shorter episode."""
    collisions: int
    frames: dict[str, Any]


def drive(
    env: FormationEnv,
    driver: Driver,
    seed: int,
    *,
    blind: bool,
    progress: Callable[[float], None],
    watch: Callable[[dict[str, Any]], None] | None = None,
    film: Callable[[Any], None] | None = None,
) -> Drive:
    """Drive one episode.

    Args:
        env: Environment, which is reset first.
        driver: Driver of all cars.
        seed: Seed of the episode.
        blind: Whether other cars are removed from the observations.
        progress: Called with the share done, 0 to 1.
        watch: Called after every control step with the frames so far.
        film: Called with pictures if the environment renders ``rgb_array``.
    """
    observations, _ = env.reset(seed=seed)
    formation, blindfold = env.formation, Blindfold(Layout.of(env.formation.parts))
    recorder = FrameRecorder(formation)
    formed: list[float] = []
    collisions = 0.0
    while env.agents:
        if blind:
            observations = {a: blindfold(o) for a, o in observations.items()}
        observations, *_ = env.step({a: driver.act(o) for a, o in observations.items()})
        formed.append(errors(formation)[1])
        collisions += formation.loop.swarm.contacts[0].sum()
        recorder.add()
        if film is not None and env.render_mode == "rgb_array":
            film(env.render())
        if watch is not None:
            watch(recorder.frames)
        progress(len(formed) / formation.parts.config.max_cycles)
    settled = formed[round(SETTLE / DECISION) :] or formed[-1:]
    return Drive(
        seconds=len(formed) * DECISION,
        done=bool(formation.task.done[0]),
        formation_error=float(np.mean(settled)),
        collisions=int(collisions),
        frames=recorder.frames,
    )
