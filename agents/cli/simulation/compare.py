"""`relpos compare`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import (
    cars_option,
    jobs_options,
    json_option,
    out_options,
    scenario_option,
    trackers_option,
)
from agents.errors import UsageError

if TYPE_CHECKING:
    from agents.comparison.result import CompareResult

SIMULATED = {
    "scenarios": "--scenario", "tasks": "--task", "cars": "--cars", "proximity": "--proximity",
    "trackers": "--trackers", "level": "--level", "operator": "--operator",
    "first_seed": "--first-seed", "jobs": "--jobs", "engine": "--engine",
    "address": "--address", "protocol": "--protocol",
}  # fmt: skip
"""Options that are not allowed with real cars, by parameter."""
SEVERAL = ("scenarios", "tasks", "observations")
"""Parameters of repeatable options, whose names are in the singular."""
WHY = "which has its own cars and task; they drive one after the other"


@click.command()
@click.argument("names", metavar="NAME...", nargs=-1, required=True)
@click.option(
    "--observation",
    "observations",
    multiple=True,
    default=("estimate",),
    show_default=True,
    help="Observation mode: estimate, estimate_cov, ranges or truth; repeatable.",
)
@scenario_option("; repeatable.  [default: that of the task]", "scenarios", multiple=True)
@click.option(
    "--task",
    "tasks",
    multiple=True,
    default=("ring",),
    show_default=True,
    help="Task: ring, hold, travel, gap, rendezvous, follow, observe, escort, seek or inspect; "
    "repeatable.",
)
@cars_option
@click.option(
    "--proximity",
    type=int,
    help="Number of distance sensors on each car, 0 to 32.  [default: those of the policies]",
)
@trackers_option
@click.option(
    "--level",
    help="Randomisation in every scenario: easy, medium, hard, expert, or 0 to 4.",
)
@click.option(
    "--protocol",
    help="Evaluation protocol, 1 or a TOML file, which fixes tasks, observations, trackers, seeds, "
    "episodes and times.",
)
@click.option(
    "--operator", default=1.0, show_default=True, help="Share of episodes with an operator, 0 to 1."
)
@click.option(
    "--episodes",
    type=int,
    help="Episodes of each driver, observation and scenario.  [default: 100; on real cars 10]",
)
@click.option("--first-seed", default=1000, show_default=True, help="Seed of the first episode.")
@click.option(
    "--seconds", default=60.0, show_default=True, help="Length of an episode, up to 3600 [s]."
)
@click.option(
    "--settle",
    default=10.0,
    show_default=True,
    help="Time of an episode from which errors are scored [s].",
)
@jobs_options("No figure depends on it.")
@click.option("--config", type=Path, help="swarm.toml: compare on real cars, in turns.")
@click.option("--arm", is_flag=True, help="Allow the cars of --config to move.")
@json_option
@out_options("report.html, its pictures and results.jsonl")
def compare(
    names: tuple[str, ...],
    observations: tuple[str, ...],
    config: Path | None,
    arm: bool,
    as_json: bool,
    out: Path | None,
    **options: Any,
) -> None:
    """Compare drivers on the same episodes: formation error, collisions, energy, with intervals.

    NAME is a controller (consensus, leader-follower, range-only, weaving) or a trained policy: its
    name, its file or its folder.

    With --config, the comparison runs on real cars in real time, with estimated errors. Keys on a
    terminal: space stops all cars immediately, c clears the stop, q quits.
    """
    from agents.output import check_folder, write_results
    from agents.reports import compare_report as report

    if out is not None:
        check_folder(out, ["report.html"])
    chosen = {k: v for k, v in options.items() if v is not None}
    if config is None:
        if arm:
            raise UsageError("--arm: expected together with --config")
        chosen = _fixed({"observations": observations, **chosen})
        result, films = _simulated(names, chosen, filmed=out is not None)
    else:
        result, films = _on_cars(names, observations, config, arm, chosen), []
    if out is not None:
        write_results(out, report.compare_files(result, films))
    if as_json:
        emit_json(result.records)
        return
    for scenario in result.groups:
        print_table(scenario, report.SHORT_HEADER, report.short_rows(result, scenario))
    for line in report.notes(result):
        click.echo(line)
    if out is not None:
        click.echo(f"written: {out / 'report.html'}")


def _fixed(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options with those that a protocol fixes, and the level as a number or name.

    Raises:
        UsageError: There is no such protocol, or an option that it fixes was given.
    """
    from agents.comparison.protocol import protocol_arguments

    level = options.get("level", "")
    if level.isdecimal():
        options["level"] = int(level)
    if "protocol" not in options:
        return options
    fixed = protocol_arguments(options["protocol"])
    context = click.get_current_context()
    for name in ("scenarios", "cars", "proximity", *fixed):
        given = context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT
        if given and name != "protocol":
            option = name.removesuffix("s") if name in SEVERAL else name
            raise UsageError(
                f"--{option.replace('_', '-')}: expected without --protocol, which fixes it"
            )
    return options | fixed


def _simulated(
    names: tuple[str, ...], options: dict[str, Any], *, filmed: bool
) -> tuple[CompareResult, list[dict[str, Any]]]:
    """Return the comparison in the simulator, and its films."""
    from agents.comparison.compare import compare as run
    from agents.comparison.film import median_films
    from agents.warm_up import warm_up_first
    from tracking.filters import DEFAULT_FILTER

    scenarios = options.pop("scenarios") or (None,)
    with progress_bar("compare", at_once=False) as tell:
        result = run(
            drivers=names,
            scenarios=scenarios,
            ready=lambda: warm_up_first([DEFAULT_FILTER], purpose="env", in_space=False),
            progress=tell,
            **options,
        )
    if not filmed:
        return result, []
    work = {k: options[k] for k in ("jobs", "engine", "address") if k in options}
    with progress_bar("film") as tell:
        return result, median_films(result, progress=tell, **work)


def _on_cars(
    names: tuple[str, ...],
    observations: tuple[str, ...],
    swarm: Path,
    arm: bool,
    options: dict[str, Any],
) -> CompareResult:
    """Return the comparison with real cars."""
    from agents.comparison.hardware import compare_hardware
    from agents.hardware.drive.keys import NO_KEYS, TerminalKeys, check_stop_source, key_by_key

    context = click.get_current_context()
    for name, option in SIMULATED.items():
        if context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT:
            raise UsageError(f"{option}: expected without --config, {WHY}")

    if arm:
        check_stop_source("terminal")
    keys = TerminalKeys()

    def attend(order: Callable[[str], None]) -> None:
        had_them = not keys.lost
        for what in keys.read_orders():
            order(what)
        if keys.lost and had_them:
            click.echo(NO_KEYS, err=True)

    given = {k: options[k] for k in ("episodes", "seconds", "settle") if k in options}
    with progress_bar("compare") as tell, key_by_key():
        return compare_hardware(
            swarm=swarm,
            drivers=names,
            observations=observations,
            arm=arm,
            attend=attend,
            progress=tell,
            **given,
        )
