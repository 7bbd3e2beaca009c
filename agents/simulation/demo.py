"""Cars keep a formation on estimates: what `relpos demo` does, as a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agents.comparison.blindfold import Blindfold
from agents.controllers import controller_builder
from agents.driver import Driver
from agents.errors import UsageError
from agents.evaluation.track import TrackResult, track_log
from agents.policies import Layout, TrainedPolicy, load_policy
from agents.simulation.frames import FrameRecorder, errors
from relpos_env import formation_v0
from relpos_env.api.parallel_env import FormationEnv
from relpos_env.timing import DECISION
from tracking.filters import DEFAULT_FILTER, FILTERS, filter_builder
from tracking.log.folder import Log
from tracking.params.short_repr import short_repr

TOLD = ("estimate", "truth", "nothing")
"""What the cars are told in the drives of a demonstration."""
CONTROLLER, TASK = "consensus", "ring"
"""Who drives the cars, and what they do, if nothing else is said."""
SETTLE = 10.0
"""[s] Errors are averaged from here on."""


@dataclass(frozen=True, slots=True)
class DemoResult:
    """One demonstration."""

    __repr__ = short_repr

    scenario: str
    task: str
    driver: str
    """The controller or policy."""
    seed: int
    seconds: float
    """[s] Length of the drive on estimates."""
    done: bool
    """Whether it ended because the task was accomplished."""
    formation_error: float
    """[m] Mean distance of the others from where they should be, tracker in the loop; as the
    task says, see `relpos_env.tasks`."""
    formation_error_truth: float | None
    """[m] The same when the cars are told the truth; None where their observations have no place
    for it."""
    formation_error_blind: float
    """[m] The same when they are told nothing and follow the operator's command alone."""
    nlos_share: float
    """[-] Share of the ranges that an obstacle was in the way of."""
    collisions: int
    """[-] Contacts that cars began, with each other, obstacles and walls."""
    tracks: tuple[TrackResult, ...]
    """The same drive tracked by some filters."""
    frames: dict[str, Any]
    """What the animation shows."""
    log: Log
    """Measurements and truth of the drive on estimates."""

    def tracked_by(self, filters: Sequence[str]) -> DemoResult:
        """With the drive tracked by other filters."""
        return replace(self, tracks=_track(self.log, filters))

    @property
    def summary(self) -> list[dict[str, Any]]:
        """The figures, one record a filter and one for the formation."""
        rows: list[dict[str, Any]] = [{"result": "tracking", **r.summary} for r in self.tracks]
        return [
            *rows,
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
    filters: Sequence[str] = tuple(FILTERS),
    window: bool = False,
    film: Callable[[Any], None] | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Callable[[dict[str, Any], str], None] | None = None,
) -> DemoResult:
    """Drive a formation on estimates and, for comparison, on the truth and on nothing.

    Args:
        scenario: One of `relpos_env.scenarios.SCENARIOS` or a TOML file; by default one that the
            policy was trained in, or that of the task.
        task: One of `relpos_env.tasks.TASKS`; by default that of the policy, or `TASK`.
        seconds: Length, less where the task is done before.
        seed: Same seed, same run.
        cars: Number of cars; by default that of the scenario.
        proximity: Beams that measure distances round each car; by default those of the policy, or
            none.
        controller: One of `agents.controllers.CONTROLLERS`, by default `CONTROLLER`.
        policy: A trained policy in its place, as for `load_policy`; the cars observe what it
            was trained on.
        filter: The cars' tracker, one of `tracking.filters.FILTERS`.
        filters: Those that track the drive afterwards, for comparison.
        window: Show the drive on estimates in a window; needs pygame.
        film: Called with a picture of it after every decision, uint8 (height, width, 3), where
            there is no window; needs pygame.
        progress: Called with the share done, 0 to 1.
        watch: Called after every decision with the frames so far and what the cars are told.

    Raises:
        ConfigError: No such filter.
        EnvError: An unknown name or a number out of range.
        UsageError: A controller and a policy, or a policy that cannot be loaded or is not for
            these cars.
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
                f"proximity: expected {trained.layout.proximity}, the beams of the policy, "
                f"got {proximity}"
            )
        proximity = trained.layout.proximity
    for n, (told, mode) in enumerate(modes.items()):

        def tell(share: float, n: int = n) -> None:
            if progress is not None:
                progress((n + share) / len(modes))

        def show(frames: dict[str, Any], told: str = told) -> None:
            if watch is not None:
                watch(frames, told)

        env = formation_v0.parallel_env(
            scenario=scenario,
            task=task,
            n_cars=cars,
            observation=mode,
            history=history,
            proximity=proximity or 0,
            max_cycles=round(seconds / DECISION),
            record=told == "estimate",
            filter=filter,
            render_mode=render if told == "estimate" else None,
        )
        driver: Driver
        if trained is None:
            driver = controller_builder(controller)(env.fields)
        else:
            driver = trained.driver(Layout(mode, len(env.possible_agents), history, proximity or 0))
        drives[told] = drive(
            env,
            driver,
            seed,
            blind=told == "nothing",
            progress=tell,
            watch=show,
            film=film,
        )
        if told == "estimate":
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
    """The drive tracked by some filters; of a simulation nothing has to be checked."""
    return tuple(track_log(log, filter=name, findings=()) for name in filters)


def _trained_for(policy: TrainedPolicy | None) -> tuple[str | None, str | None]:
    """Task and first scenario that a policy was trained for, where its card tells."""
    training = {} if policy is None else policy.card.training
    task, scenario = training.get("task"), training.get("scenario")
    return None if task is None else str(task), None if scenario is None else str(scenario)


def _modes(policy: TrainedPolicy | None) -> dict[str, str]:
    """The observation mode of each drive, by what the cars are told."""
    modes = {told: "truth" if told == "truth" else "estimate" for told in TOLD}
    if policy is not None and policy.layout.observation not in modes.values():
        # What this policy sees is measured, and has no true counterpart.
        del modes["truth"]
        return dict.fromkeys(modes, policy.layout.observation)
    return modes


@dataclass(frozen=True, slots=True)
class Drive:
    """One episode."""

    seconds: float
    done: bool
    """Whether the task was accomplished and ended it."""
    formation_error: float
    """[m] Mean from `SETTLE` on, or that of the end if it came before."""
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
        env: Is reset first.
        driver: Drives all cars.
        seed: Of the episode.
        blind: Whether the observations are changed so that no other car is known.
        progress: Called with the share done, 0 to 1.
        watch: Called after every decision with the frames so far.
        film: Called with pictures of an environment that makes them.
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
