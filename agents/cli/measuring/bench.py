"""`relpos bench`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import json_option, out_options
from agents.errors import UsageError


@click.group()
def bench() -> None:
    """Measure speed, each figure against a peer in the same run."""


@bench.command("tracker")
@click.option("--rounds", default=2000, show_default=True, help="Ranging rounds per figure.")
@out_options("a picture of the time over the group's size")
@json_option
def bench_tracker(rounds: int, out: Path | None, as_json: bool) -> None:
    """Measure ranging rounds, messages and an hour of tracking against filterpy and GTSAM."""
    from agents.bench.tracker import bench_tracker as run
    from agents.output import check_folder
    from agents.reports.bench.tracker_figures import PICTURE

    if rounds < 100:
        raise UsageError(f"--rounds: expected at least 100, got {rounds}")
    if out is not None:
        check_folder(out, [PICTURE])
    with progress_bar("tracker") as report:
        rows = run(rounds=rounds, progress=report, tell=lambda note: click.echo(note, err=True))
    if out is not None:
        _draw_growth(out)
    _show_bench("Time of the tracker", rows, as_json)
    if out is not None and not as_json:
        click.echo(f"written: {out / PICTURE}")


def _draw_growth(out: Path) -> None:
    from agents.bench.tracker.growth import growth
    from agents.output import write_results
    from agents.reports.bench.tracker_figures import PICTURE, cost_figure
    from agents.reports.style import svg

    with progress_bar("sizes of groups") as report:
        result = growth(progress=report)
    write_results(out, {PICTURE: svg(cost_figure(result))})


@bench.command("radio")
@json_option
def bench_radio(as_json: bool) -> None:
    """Measure message-level ranging rounds against the reference session."""
    from agents.bench.radio import bench_radio as run

    with progress_bar("radio") as report:
        rows = run(progress=report)
    _show_bench("Time of one message-level round", rows, as_json)


@bench.command("policy")
@click.option("--steps", default=2000, show_default=True, help="Number of calls per repetition.")
@json_option
def bench_policy(steps: int, as_json: bool) -> None:
    """Measure policy inference against plain numpy."""
    from agents.bench.policy import bench_policy as run

    if not 1 <= steps <= 1_000_000:
        raise UsageError(f"--steps: expected 1 to 1000000, got {steps}")
    with progress_bar("policy") as report:
        rows = run(steps=steps, progress=report)
    _show_bench("Time of one step of a policy", rows, as_json)


@bench.command("codec")
@click.option("--frames", default=5000, show_default=True, help="Number of frames per repetition.")
@json_option
def bench_codec(frames: int, as_json: bool) -> None:
    """Measure frames per second of the wire format against pymavlink."""
    from agents.bench.codec import bench_codec as run

    if not 1 <= frames <= 100_000:
        raise UsageError(f"--frames: expected 1 to 100000, got {frames}")
    with progress_bar("codec") as report:
        rows = run(frames=frames, progress=report)
    _show_bench("Frames per second of the wire format", rows, as_json)


@bench.command("train")
@click.option("--updates", default=6, show_default=True, help="Number of updates per repetition.")
@click.option(
    "--threads", default=2, show_default=True, help="Number of threads of simulation and learning."
)
@click.option(
    "--after", default=2, show_default=True, help="Number of updates before the measurement."
)
@json_option
def bench_train(updates: int, threads: int, after: int, as_json: bool) -> None:
    """Measure agent steps per second of training against an environment without cost."""
    if not 1 <= updates <= 10_000:
        raise UsageError(f"--updates: expected 1 to 10000, got {updates}")
    if not 1 <= threads <= 64:
        raise UsageError(f"--threads: expected 1 to 64, got {threads}")
    if not 1 <= after <= 10_000:
        raise UsageError(f"--after: expected 1 to 10000, got {after}")
    try:
        from agents.bench.train import bench_train as run
    except ImportError as error:
        raise UsageError(
            f"training needs {error.name}: pip install -e '.[train]' in its source folder"
        ) from error
    with progress_bar("training") as report:
        rows = run(updates=updates, threads=threads, after=after, progress=report)
    _show_bench("Frames per second of training", rows, as_json)


@bench.command("cold")
@click.option("--install", is_flag=True, help="Also install into a new environment, with pip.")
@json_option
def bench_cold(install: bool, as_json: bool) -> None:
    """Measure installing, importing, compiling and the first run; takes minutes."""
    from agents.bench.cold import bench_cold as run

    with progress_bar("first time") as report:
        rows = run(install=install, progress=report)
    _show_bench("The first time", rows, as_json)


@bench.command("env")
@click.option("--quick", is_flag=True, help="Measure fewer and shorter figures.")
@out_options("a picture of the curves and the parts")
@json_option
def bench_env(quick: bool, out: Path | None, as_json: bool) -> None:
    """Measure environment steps per second against mpe2 and bare pymunk."""
    from agents.bench.env import bench_env as run
    from agents.bench.env.effort import FULL, QUICK
    from agents.output import check_folder, write_results
    from agents.reports.bench.env_figures import ENV_PICTURE, env_figure
    from agents.reports.style import svg

    if out is not None:
        check_folder(out, [ENV_PICTURE])
    with progress_bar("environments") as report:
        rows = run(
            QUICK if quick else FULL,
            progress=report,
            tell=lambda note: click.echo(note, err=True),
        )
    if out is not None:
        write_results(out, {ENV_PICTURE: svg(env_figure(rows))})
    if as_json:
        emit_json(rows)
    else:
        _show_env(rows)
    if out is not None and not as_json:
        click.echo(f"written: {out / ENV_PICTURE}")


def _show_env(rows: list[dict[str, Any]]) -> None:
    header = ["figure", "envs", "cars", "cores", "env-steps/s", "us", "peer", "ratio"]
    cells = []
    for r in rows:
        rate, ratio = r["env_steps_per_s"], r["ratio"]
        cells.append(
            [
                r["what"],
                str(r["envs"]),
                str(r["cars"]),
                str(r["threads"] * r["processes"]),
                "" if rate is None or ":" in r["what"] else f"{rate:.0f}",
                f"{r['us_per_env_step']:.1f}",
                r["peer"] or "",
                "" if ratio is None else f"{ratio:.2f}",
            ]
        )
    print_table("Time of environment steps", header, cells)
    shares = [r for r in rows if "solver_share" in r]
    for r in shares:
        click.echo(f"{r['what']}: the solver makes {100.0 * r['solver_share']:.1f} % of sub-steps")
    held = max(rows, key=lambda r: r["envs"] if "array_bytes_per_env" in r else 0)
    text = f"memory of an environment of {held['cars']} cars: arrays "
    text += f"{held['array_bytes_per_env'] / 1024.0:.0f} KiB"
    if held["resident_bytes_per_env"] is not None:
        text += f", process {held['resident_bytes_per_env'] / 1024.0:.0f} KiB"
    click.echo(f"{text} ({held['envs']} environments)")


def _show_bench(title: str, rows: list[dict[str, Any]], as_json: bool) -> None:
    if as_json:
        emit_json(rows)
        return
    header = ["case", "value", "unit", "peer", "peer value", "ratio"]
    figures = [(f"{r['value']:.2f}", f"{r['peer_value']:.1f}", _ratio(r["ratio"])) for r in rows]
    cells = [
        [r["case"], value, r["unit"], r["peer"], peer, ratio]
        for r, (value, peer, ratio) in zip(rows, figures, strict=True)
    ]
    print_table(title, header, cells)


def _ratio(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2f}"
