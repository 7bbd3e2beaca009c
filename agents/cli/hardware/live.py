"""`relpos live`."""

from __future__ import annotations

import signal
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import json_option

if TYPE_CHECKING:
    from agents.hardware.live.monitor import Monitor
    from agents.hardware.live.screen import Screen
    from agents.hardware.view import Viewer

BROWSER = "browser"


@click.command()
@click.option("--config", type=Path, required=True, help="swarm.toml; see docs/how-to/hardware.md.")
@click.option(
    "--node",
    type=int,
    metavar="N",
    help="Track by what the radio of this node received, as its own computer would.",
)
@click.option("--seconds", type=float, help="Length [s].  [default: until Ctrl-C]")
@click.option("--record", type=Path, help="New file for a recording of all bytes.")
@click.option(
    "--view",
    is_flag=False,
    flag_value=BROWSER,
    metavar="[FILE.rrd]",
    help="Show the swarm in the browser, or write the view to a new file.",
)
@json_option
def live(
    config: Path,
    node: int | None,
    seconds: float | None,
    record: Path | None,
    view: str | None,
    as_json: bool,
) -> None:
    """Track a live swarm: nodes, relative positions and their uncertainty."""
    from agents.hardware.live import live as run
    from hardware_bridge.config import read_config

    swarm = read_config(config)
    # Termination signals also close the recording.
    for name in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(name, signal.default_int_handler)
    with ExitStack() as stack:
        viewer = None
        if view is not None:
            viewer = stack.enter_context(_open_viewer(view, swarm.name))
        screen = stack.enter_context(_screen(swarm.name, as_json))

        def watch(monitor: Monitor, notices: list[tuple[float, str]]) -> None:
            screen.show(monitor, notices)
            if viewer is not None:
                viewer.show(monitor.snapshot(), notices)

        result = run(swarm, node=node, seconds=seconds, record=record, watch=watch, keep=False)
    if as_json:
        emit_json({"result": "stream", **stream} for stream in result.streams)
        emit_json([result.summary])
        return
    print_streams(result.streams)
    click.echo(
        f"{result.seconds:.1f} s, {result.decisions} decisions, {result.late_decisions} late"
    )
    if record is not None:
        lost = result.recording_lost
        click.echo(f"recorded: {record}" + (f", incomplete: {lost}" if lost else ""))


def print_streams(streams: tuple[dict[str, object], ...]) -> None:
    """Print the decoder statistics."""
    names = ["bytes", "frames", "skipped", "damaged", "strange"]
    rows = [[str(s["stream"]), *(str(s[name]) for name in names)] for s in streams]
    print_table("Streams", ["stream", *names], rows)


def _screen(title: str, as_json: bool) -> Screen:
    from agents.hardware.live.screen import JsonLines, Lines, LiveTable

    if as_json:
        return JsonLines()
    if sys.stdout.isatty():
        return LiveTable(title)
    return Lines()


def _open_viewer(view: str, name: str) -> Viewer:
    from agents.hardware.view import open_viewer

    file = None if view == BROWSER else Path(view)
    viewer = open_viewer(name, file)
    if viewer.url is not None:
        click.echo(f"view: {viewer.url}", err=True)
    return viewer
