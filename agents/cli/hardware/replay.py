"""`relpos replay`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from agents.cli.console import emit_json, print_table
from agents.cli.hardware.live import print_streams
from agents.cli.options import json_option
from agents.errors import UsageError

if TYPE_CHECKING:
    from agents.hardware.live.monitor import Monitor
    from agents.hardware.replay import ReplayResult


@click.command()
@click.argument("recording", type=Path)
@click.option("--speed", type=float, help="Speed of the replay; 1 is real time.")
@click.option("--fast", is_flag=True, help="Replay as fast as possible.  [default]")
@click.option(
    "--filter",
    help="Filter: joint, ekf-mds, ekf, paper-ekf-mds or paper-ekf.  [default: that of the "
    "recording]",
)
@click.option(
    "--keys",
    type=Path,
    metavar="SWARM.TOML",
    help="For the keys of signed messages, which recordings do not hold; without, signatures are "
    "not checked.",
)
@click.option(
    "--export",
    "exports",
    multiple=True,
    help="Export format into --out: log, mcap or tum; repeatable.",
)
@click.option("--out", type=Path, help="New folder for exports.")
@click.option("--truth", type=Path, help="Log folder with the truth to score against.")
@click.option(
    "--truth-offset",
    default="auto",
    show_default=True,
    help="Offset added to the times of the truth [s]; auto finds it by the ranges.",
)
@click.option(
    "--skip",
    default=10.0,
    show_default=True,
    help="Time after the first range that is not scored [s].",
)
@click.option("--view", type=Path, metavar="FILE.rrd", help="New file for the view.")
@json_option
def replay(
    recording: Path,
    speed: float | None,
    fast: bool,
    filter: str | None,
    keys: Path | None,
    exports: tuple[str, ...],
    out: Path | None,
    truth: Path | None,
    truth_offset: str,
    skip: float,
    view: Path | None,
    as_json: bool,
) -> None:
    """Track a recording again; the same bytes give the same estimates as live."""
    from contextlib import ExitStack

    from agents.hardware.live.screen import JsonLines, Lines
    from agents.hardware.replay import replay as run
    from agents.hardware.replay.exports import check_formats, export_replay
    from agents.output import check_new

    exports = tuple(dict.fromkeys(exports))
    check_formats(exports)
    if fast and speed is not None:
        raise UsageError("--fast: expected either it or --speed")
    if bool(exports) != (out is not None):
        raise UsageError("--export, --out: expected together, what is written and its folder")
    if not 0.0 <= skip < float("inf"):
        raise UsageError(f"--skip: expected 0 or more seconds, got {skip:g}")
    offset = _offset(truth_offset)
    if out is not None:
        check_new(out)
    with ExitStack() as stack:
        viewer = None
        if view is not None:
            from agents.hardware.view import open_viewer

            viewer = stack.enter_context(open_viewer(recording.stem, view))
        screen = JsonLines() if as_json else Lines() if speed is not None else None

        def watch(monitor: Monitor, notices: list[tuple[float, str]]) -> None:
            if screen is not None:
                screen.show(monitor, notices)
            if viewer is not None:
                viewer.show(monitor.snapshot(), notices)

        result = run(
            recording,
            speed=speed,
            filter=filter,
            keys=keys,
            truth=truth,
            truth_offset=offset,
            skip=skip,
            keep=bool(exports),
            watch=watch,
        )
        if viewer is not None and result.scored is not None:
            viewer.show_errors(result.estimate, result.scored.errors, result.scored.has_truth)
    written = [] if out is None else export_replay(result, out, exports)
    if as_json:
        emit_json({"result": "stream", **stream} for stream in result.streams)
        emit_json([{**result.summary, "written": [str(path) for path in written]}])
        return
    print_replay(result)
    for path in written:
        click.echo(f"written: {path}")


def print_replay(result: ReplayResult) -> None:
    """Print counts, the last estimates, and errors if there is truth."""
    from agents.hardware.live.text import pair_header, pair_rows
    from agents.reports.page import metres, percent

    print_streams(result.streams)
    title = f"Estimates after {result.seconds:.1f} s"
    print_table(title, pair_header(result.last), pair_rows(result.last))
    s = result.summary
    counts = ", ".join(f"{n} {name}" for name, n in s["measurements"].items() if n)
    refused = ", ".join(f"{n} {name}" for name, n in s["refused"].items()) or "none"
    click.echo(
        f"{s['decisions']} decisions, measurements: {counts or 'none'}; refused: {refused}; "
        f"later than the horizon: {s['late_measurements']}; "
        f"{result.realtime_factor:.0f} times faster than real time"
    )
    for flaw in result.flaws:
        click.echo(f"incomplete: {flaw}")
    if result.scored is not None:
        score = result.scored.score
        figures = (score.rmse, score.rmse_yaw, score.rmse_shape)
        names = ("rmse", "rmse_yaw", "rmse_shape")
        text = ", ".join(f"{n} {metres(v)} m" for n, v in zip(names, figures, strict=True))
        click.echo(
            f"against the truth, {result.scored.offset:+.3f} s later: {text}, "
            f"status ok {percent(score.ok_share)} of the time"
        )
        if score.rmse is None:
            click.echo("nothing to compare: no estimate at a time of the truth behind --skip")


def _offset(text: str) -> float | None:
    """Return the offset [s], or None for auto."""
    if text == "auto":
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < float("inf"):
        raise UsageError(f"--truth-offset: expected seconds or auto, got {text}")
    return value
