"""`relpos demo`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import (
    cars_option,
    json_option,
    out_options,
    policy_option,
    scenario_option,
    trackers_option,
)
from agents.cli.tracking.track import print_tracks
from agents.errors import UsageError


@click.command()
@scenario_option("; by default that of the policy or of the task.")
@click.option(
    "--task",
    help="Task: ring, hold, travel, gap, rendezvous, follow, observe, escort, seek or inspect.  "
    "[default: that "
    "of the policy, or ring]",
)
@click.option("--seconds", default=60.0, show_default=True, help="Length, 15 to 3600 [s].")
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same run."
)
@cars_option
@click.option(
    "--proximity",
    type=int,
    help="Number of distance sensors on each car, 0 to 32.  [default: those of the policy]",
)
@click.option(
    "--controller",
    metavar="NAME",
    help="Controller that drives: consensus, leader-follower, range-only or weaving.  "
    "[default: consensus]",
)
@policy_option
@click.option(
    "--filter",
    default="joint",
    show_default=True,
    help="Filter of the tracker: joint, ekf-mds, ekf, paper-ekf-mds or paper-ekf.",
)
@trackers_option
@click.option("--window", is_flag=True, help="Show the drive in a window; needs pygame.")
@click.option("--gif", is_flag=True, help="Write drive.gif too; needs pygame.")
@out_options("report.html and drive.gif", default=Path("demo"))
@json_option
def demo(
    seconds: float,
    seed: int,
    cars: int | None,
    window: bool,
    gif: bool,
    out: Path,
    as_json: bool,
    **names: Any,
) -> None:
    """Simulate cars in a formation on estimated relative positions; writes report.html."""
    from agents.output import check_folder, write_results
    from agents.reports.demo_report import demo_report
    from agents.reports.gif import Gif
    from agents.reports.page import metres
    from agents.simulation.demo import SETTLE, TASK, DemoResult
    from agents.simulation.demo import demo as run
    from agents.simulation.terminal_view import LiveRoom
    from agents.warm_up import ORIENTATION, BackgroundWarmUp, Part, parts_of, shown_progress
    from relpos_env.timing import DECISION
    from tracking.filters import FILTERS

    if not 15.0 <= seconds <= 3600.0:
        raise UsageError(f"--seconds: expected 15 to 3600, got {seconds:g}")
    if seed < 0:
        raise UsageError(f"--seed: expected 0 or more, got {seed}")
    if cars is not None and not 2 <= cars <= 20:
        raise UsageError(f"--cars: expected 2 to 20, got {cars}")
    if names["proximity"] is not None and not 0 <= names["proximity"] <= 32:
        raise UsageError(f"--proximity: expected 0 to 32, got {names['proximity']}")
    if names["policy"] is not None and names["controller"] is not None:
        raise UsageError("--policy: expected either a policy or a --controller, got both")
    if window and gif:
        raise UsageError("--gif: expected without --window, which shows what would be written")
    check_folder(out, ["report.html", "drive.gif"] if gif else ["report.html"])
    ours = names["filter"]
    is_usual = names["task"] in (None, TASK)
    # The drive itself compiles the orientation kernels.
    spared = {ORIENTATION, "tasks"} if is_usual else {ORIENTATION}

    def parts(purpose: str, *filters: str) -> list[Part]:
        every = parts_of(purpose, filters, in_space=False)
        return [part for part in every if part.name not in spared]

    needed = parts("env", *({ours} & set(FILTERS)))
    # In one call, since filters share parts.
    later = parts("track", *sorted(FILTERS, key=lambda name: name != ours))
    missing = [
        name
        for name in FILTERS
        if name != ours and not all(part.is_kept() for part in parts("track", name))
    ]
    with BackgroundWarmUp(needed, later) as others, ExitStack() as stack:
        with shown_progress() as tell_compiled:
            others.wait_for_needed(tell_compiled)
        room = stack.enter_context(LiveRoom())
        pictures = Gif(every=2, interval=DECISION)
        titles = {"estimate": "on estimates", "truth": "on the truth", "nothing": "on nothing"}

        def watch(frames: dict[str, Any], information: str) -> None:
            room.show(frames, f"cars drive {titles[information]}")

        with progress_bar("drives", shown=not room.shown) as tell:
            result: DemoResult = run(
                seconds=seconds,
                seed=seed,
                cars=cars,
                filters=[ours],
                window=window,
                film=pictures.add if gif else None,
                progress=tell,
                watch=watch,
                **names,
            )
        files: dict[str, str | bytes] = {"report.html": demo_report(result, missing)}
        if gif:
            files["drive.gif"] = pictures.to_bytes()
        write_results(out, files)
        if missing:
            click.echo(f"open {out / 'report.html'}; its last table follows", err=True)
        room.replay(result.frames, "compiling other filters for the last table", others.is_done)
        others.wait()
    result = result.tracked_by(tuple(dict.fromkeys([*FILTERS, ours])))
    write_results(out, {"report.html": demo_report(result)})
    if as_json:
        emit_json(result.summary)
        return
    print_tracks(result.tracks)
    print_table(
        f"Formation error, {result.driver} drives",
        ["information of the cars", f"mean after {SETTLE:.0f} s [m]"],
        [
            ["what the tracker estimates", metres(result.formation_error)],
            ["the truth", metres(result.formation_error_truth)],
            ["nothing, only the command", metres(result.formation_error_blind)],
        ],
    )
    done = f", done after {result.seconds:.1f} s" if result.done else ""
    click.echo(
        f"{100 * result.nlos_share:.0f} % of the ranges behind an obstacle, "
        f"{result.collisions} collisions{done}\nopen {out / 'report.html'} to see the drive"
    )
