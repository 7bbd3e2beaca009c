"""`relpos drive`."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import json_option, policy_option
from agents.errors import UsageError

if TYPE_CHECKING:
    from hardware_bridge.live.env import HardwareFormationEnv
    from hardware_bridge.live.opened import OpenBridge

EVERY = 10
"""[-] Control steps between two JSON records."""


@click.command()
@click.option("--config", type=Path, required=True, help="swarm.toml; see docs/how-to/hardware.md.")
@click.option(
    "--node",
    type=int,
    metavar="N",
    help="Drive the car of this node alone, on its own computer, by what its own radio received.",
)
@policy_option
@click.option(
    "--controller",
    metavar="NAME",
    help="Controller that drives: consensus, leader-follower, range-only or weaving.  "
    "[default: consensus]",
)
@click.option("--observation", help="Observation mode.  [default: that of the policy, or estimate]")
@click.option("--arm", is_flag=True, help="Allow the cars to move; without it no command is sent.")
@click.option(
    "--stop-source",
    type=click.Choice(["terminal", "stdin"]),
    default="terminal",
    show_default=True,
    help="Where --arm takes keys from: a terminal, or a program that writes them to standard input "
    "and a dot at least once a second; its silence stops the cars.",
)
@click.option("--seconds", type=float, help="Length, 1 to 86400 [s].  [default: until Ctrl-C]")
@click.option(
    "--wait", default=60.0, show_default=True, help="Longest wait until all checks pass [s]."
)
@click.option(
    "--record", type=Path, help="New file for a recording of all bytes received and sent."
)
@json_option
def drive(
    config: Path,
    node: int | None,
    policy: str | None,
    controller: str | None,
    observation: str | None,
    arm: bool,
    stop_source: str,
    seconds: float | None,
    wait: float,
    record: Path | None,
    as_json: bool,
) -> None:
    """Drive real cars on the estimates of their trackers. Dry run unless --arm.

    Keys: space stops all cars immediately, c clears the stop, a arms again, d disarms, g marks
    silent cars as gone, q quits; any other key stops.
    """
    from agents.hardware.drive import drive as run
    from agents.hardware.drive.keys import check_stop_source

    if policy is not None and controller is not None:
        raise UsageError("--policy: expected either a policy or a --controller, got both")
    if seconds is not None and not 1.0 <= seconds <= 86400.0:
        raise UsageError(f"--seconds: expected 1 to 86400, got {seconds:g}")
    if not 1.0 <= wait <= 3600.0:
        raise UsageError(f"--wait: expected 1 to 3600, got {wait:g}")
    if arm:
        check_stop_source(stop_source)
        # Late commands stop the cars; without permission, the default priority is used.
        with suppress(OSError, AttributeError):
            os.setpriority(os.PRIO_PROCESS, 0, -5)
    # Termination signals also stop the cars and restore the terminal.
    for name in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(name, signal.default_int_handler)
    with _Screen(as_json, stop_source) as screen:
        result = run(
            config=config,
            node=node,
            name=policy or controller or "consensus",
            observation=observation,
            arm=arm,
            seconds=seconds,
            wait=wait,
            record=record,
            watch=screen.show,
            attend=screen.attend,
        )
    if as_json:
        emit_json([result.summary])
        return
    figures = {name: value for name, value in result.summary.items() if name != "result"}
    stops = figures.pop("stops")
    print_table("Drive", ["", "value"], [[name, _text(value)] for name, value in figures.items()])
    for stop in stops:
        click.echo(stop)
    if record is not None:
        lost = result.recording_lost
        click.echo(f"recorded: {record}" + (f", incomplete: {lost}" if lost else ""))


class _Screen:
    """Output and keys during a drive."""

    def __init__(self, as_json: bool, stop_source: str) -> None:
        from agents.hardware.drive.keys import PipedKeys, TerminalKeys

        self._json, self._n, self._n_shown = as_json, 0, 0
        self._source = PipedKeys() if stop_source == "stdin" else TerminalKeys()
        self._live: Any = None
        self._keys: Any = None

    def __enter__(self) -> _Screen:
        from rich.console import Console
        from rich.live import Live

        from agents.hardware.drive.keys import key_by_key

        console = Console(stderr=True)
        if console.is_terminal and not self._json:
            self._live = Live(console=console, auto_refresh=False)
            self._live.start()
        self._keys = key_by_key()
        self._keys.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._keys.__exit__(None, None, None)
        if self._live is not None:
            self._live.stop()

    def attend(self, order: Any) -> None:
        """Pass the commands of pressed keys to `order`."""
        from agents.hardware.drive.keys import NO_KEYS

        had_them = not self._source.lost
        for what in self._source.read_orders():
            order(what)
        if self._source.lost and had_them and self._live is None:
            click.echo(NO_KEYS, err=True)

    def show(self, bridge: OpenBridge, env: HardwareFormationEnv) -> None:
        """Show the state after a control step."""
        from agents.hardware.drive.status import HEADER, car_rows, status_record

        notices = [text for _, text in bridge.feed.notices]
        self._n += 1
        if self._live is not None:
            from agents.hardware.drive.keys import HELP, NO_KEYS
            from agents.hardware.drive.status import LINES

            keys = NO_KEYS if self._source.lost else HELP
            self._live.update(_table(HEADER, car_rows(bridge, env), notices[-LINES:], keys))
            self._live.refresh()
            return
        for text in notices[self._n_shown :]:
            click.echo(text, err=True)
        self._n_shown = len(notices)
        if self._json and self._n % EVERY == 0:
            emit_json([status_record(bridge, env)])
            sys.stdout.flush()


def _table(header: tuple[str, ...], rows: list[list[str]], notices: list[str], keys: str) -> Any:
    from rich import box
    from rich.console import Group
    from rich.markup import escape
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE)
    for name in header:
        # Long cells are truncated: the cars and the keys must stay visible.
        table.add_column(escape(name), no_wrap=True, overflow="ellipsis")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    texts = [Text(notice, no_wrap=True, overflow="ellipsis") for notice in notices]
    # On a small terminal the end is cut off.
    return Group(Text(keys, style="bold"), table, *texts)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}"
    return str(value)
