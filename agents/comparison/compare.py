"""Comparison of drivers (controllers and policies) by simulation (`relpos compare`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.comparison.arguments import check_numbers, each_once, modes
from agents.comparison.contender import Contender, find_entry, line_up
from agents.comparison.episode import run_episodes
from agents.comparison.meter import EpisodeResult
from agents.comparison.result import CompareResult, Row
from agents.comparison.setting import Setting
from agents.errors import UsageError
from agents.jobs import check_jobs, find_engine
from agents.simulation.demo import SETTLE
from relpos_env.core.tracked_world import Trackers
from relpos_env.interface.rangefinders import MAX_RANGEFINDERS

FIRST_SEED = 1000
"""Seed of the first episode. Training draws its seeds at random from 2^30 numbers."""
BATCH = 10
"""[-] Episodes per batch of a process."""


def compare(
    *,
    drivers: Sequence[str],
    observations: Sequence[str] = ("estimate",),
    scenarios: Sequence[str | Path | None] = (None,),
    tasks: Sequence[str] = ("ring",),
    task_options: Mapping[str, Any] | None = None,
    cars: int | None = None,
    trackers: Trackers = "group",
    level: int | str | None = None,
    operator: float = 1.0,
    proximity: int | None = None,
    episodes: int = 100,
    first_seed: int = FIRST_SEED,
    seconds: float = 60.0,
    settle: float = SETTLE,
    protocol: str | None = None,
    jobs: int = 1,
    engine: str = "local",
    address: str | None = None,
    ready: Callable[[], None] = lambda: None,
    progress: Callable[[float], None] = lambda share: None,
) -> CompareResult:
    """Evaluate every driver on every observation mode in every scenario, on the same seeds.

    Incompatible combinations are omitted and listed in `notes`. With more than one job the calling
    script must be importable: put its code below `if __name__ == "__main__"`.

    Args:
        drivers: Controllers of `agents.controllers.CONTROLLERS`, and policies as for
            `agents.policies.load_policy`.
        observations: Modes of `relpos_env.interface.observations.OBSERVATIONS`.
        scenarios: Names of `relpos_env.scenarios.SCENARIOS` or TOML files; None for the task's own.
        tasks: Names in `relpos_env.tasks.TASKS`.
        task_options: Options of the task, by name.
        cars: Slots for cars; by default the maximum of the scenario.
        trackers: `group` for one tracker of the group, `own` for one on each car.
        level: Level of the randomisation, 0 to 4, or easy, medium, hard, expert.
        operator: Share of episodes with an operator; in the others cars only follow the plan, as
            real cars without a remote control do [-].
        proximity: Distance sensors per car; by default those that each policy was trained with,
            and for controllers the maximum of all policies, or none.
        episodes: Episodes per driver, mode and scenario.
        first_seed: Seed of the first episode.
        seconds: Length of an episode, shorter if the task is accomplished [s].
        settle: Time from which errors are scored [s].
        protocol: Name of the protocol that the arguments are of, for reports
            (`agents.comparison.protocol.protocol_arguments`).
        jobs: Parallel processes; the results do not depend on it.
        engine: One of `agents.jobs.ENGINES`.
        address: Address of a running cluster, see `agents.jobs.find_engine`.
        ready: Called when the arguments have been checked, before the first episode.
        progress: Called with the completed share, 0 to 1.

    Raises:
        UsageError: A name is unknown, a number out of range, or no combination can be compared;
            the message contains the option.
        EnvError: The scenario or task does not exist, or the number of cars does not fit.
    """
    check_numbers(episodes, first_seed, seconds, settle)
    if not 0.0 <= operator <= 1.0:
        raise UsageError(f"--operator: expected 0 to 1, got {operator:g}")
    check_jobs(jobs)
    work = find_engine(engine, address)
    settings = [
        Setting(
            scenario=scenario,
            task=task,
            task_options=dict(task_options or {}),
            cars=cars,
            trackers=trackers,
            level=level,
            operator=operator,
            seconds=seconds,
            settle=settle,
        )
        for task in each_once("--task", tasks)
        for scenario in each_once("--scenario", scenarios)
    ]
    if proximity is not None and not 0 <= proximity <= MAX_RANGEFINDERS:
        raise UsageError(f"--proximity: expected 0 to {MAX_RANGEFINDERS}, got {proximity}")
    chosen = line_up(each_once("NAME", drivers), modes(observations), proximity)
    empty, notes = _who_can(chosen, settings)
    seeds = range(first_seed, first_seed + episodes)
    batches = [
        (row.contender, row.setting, seeds[k : k + BATCH])
        for k in range(0, episodes, BATCH)
        for row in empty
    ]
    ready()
    progress(0.0)
    done: dict[int, list[EpisodeResult]] = {}
    for n, found in work(run_episodes, batches, jobs):
        done[n] = found
        progress(len(done) / len(batches))
    rows = [
        Row(
            contender=row.contender,
            trained_on=row.trained_on,
            setting=row.setting,
            scenario=row.scenario,
            group=row.group,
            cars=row.cars,
            episodes=tuple(e for n in range(k, len(batches), len(empty)) for e in done[n]),
        )
        for k, row in enumerate(empty)
    ]
    return CompareResult(
        rows=tuple(rows),
        notes=tuple(notes),
        first_seed=first_seed,
        seeds=episodes,
        protocol=protocol,
    )


def _who_can(
    contenders: Sequence[Contender], settings: Sequence[Setting]
) -> tuple[list[Row], list[str]]:
    """Return rows without episodes of the compatible candidates, and notes on the others."""
    rows: list[Row] = []
    n_tasks = len({setting.task for setting in settings})
    refused: dict[tuple[str, str], list[str]] = {}
    for setting in settings:
        for contender in contenders:
            entry = find_entry(contender.name)
            parts = setting.parts(contender.observation, entry.history, contender.proximity)
            why = entry.refusal(contender.observation, parts.n_cars, contender.proximity)
            name = parts.scenario.name
            group = name if n_tasks == 1 else f"{setting.task} in {name}"
            if why is not None:
                refused.setdefault((contender.label, why), []).append(group)
                continue
            rows.append(
                Row(
                    contender=contender,
                    trained_on=entry.trained_on,
                    setting=setting,
                    scenario=name,
                    group=group,
                    cars=parts.n_cars,
                    episodes=(),
                )
            )
    notes = [f"{who} in {', '.join(names)}: {why}" for (who, why), names in refused.items()]
    if not rows:
        raise UsageError("NAME: nothing to compare: " + "; ".join(notes))
    found = {
        (setting.task, setting.parts(rows[0].contender.observation, 1).scenario.name)
        for setting in settings
    }
    if len(found) < len(settings):
        raise UsageError("--scenario: expected scenarios of different names")
    return rows, notes
