"""`relpos doctor`."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from agents.cli.console import emit_json
from agents.cli.options import json_option

if TYPE_CHECKING:
    from agents.hardware.inspection.diagnosis import LinkReport
    from agents.hardware.inspection.doctor import Diagnosis, PortReport


@click.command()
@click.option("--config", type=Path, help="swarm.toml: listen to its links and cars too.")
@click.option("--seconds", default=3.0, show_default=True, help="Time to listen, 0.1 to 3600 [s].")
@click.option(
    "--watchdog",
    is_flag=True,
    help="Measure how long each car goes on without commands. Its WHEELS TURN: lift them off the "
    "ground.",
)
@click.option(
    "--wheels-up", is_flag=True, help="Confirm for --watchdog that all wheels are off the ground."
)
@click.option("--write", is_flag=True, help="Write the results of --watchdog into swarm.toml.")
@json_option
def doctor(
    config: Path | None,
    seconds: float,
    watchdog: bool,
    wheels_up: bool,
    write: bool,
    as_json: bool,
) -> None:
    """Check ports, links and cars; no car moves unless --watchdog is given.

    Exits with status 0 if all checks pass, else with status 2 and a line for each problem.
    """
    from agents.hardware.inspection.doctor import doctor as run

    swarm = None
    if config is not None:
        from hardware_bridge.config import read_config  # type: ignore

        swarm = read_config(config)
    if watchdog or wheels_up or write:
        _measure(config, swarm, watchdog, wheels_up, write, as_json)
        return
    diagnosis = run(swarm, seconds=seconds)
    if as_json:
        emit_json(diagnosis.records)
    else:
        _print(diagnosis)
    if not diagnosis.ok:
        sys.exit(2)


def _measure(
    path: Path | None, swarm: Any, watchdog: bool, wheels_up: bool, write: bool, as_json: bool
) -> None:
    """Measure the watchdogs of the cars."""
    from agents.errors import UsageError
    from agents.hardware.inspection.watchdog import measure_watchdogs, with_watchdogs

    if not watchdog:
        raise UsageError("--wheels-up, --write: expected together with --watchdog")
    if path is None:
        raise UsageError("--watchdog: expected --config, which says where the cars are")
    if not wheels_up:
        raise UsageError(
            "--watchdog: expected --wheels-up as well, once all wheels are off the ground"
        )
    # A termination signal must still send neutral to the car.
    for name in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(name, signal.default_int_handler)
    found = measure_watchdogs(swarm, tell=lambda line: click.echo(line, err=True))
    if write:
        with_watchdogs(path, found)
    if as_json:
        emit_json([each.record for each in found])
    else:
        for each in found:
            text = each.problem or f"stops by itself after {each.seconds:g} s"
            click.echo(f"  {'problem' if each.problem else 'ok     '} cars.{each.car}: {text}")
            if not (each.problem or write):
                click.echo(f"          [cars.{each.car}] watchdog = {each.seconds:g}")
    if any(each.problem for each in found):
        sys.exit(2)


def _print(diagnosis: Diagnosis) -> None:
    click.echo("Serial ports")
    for port in diagnosis.ports:
        _print_port(port)
    if not diagnosis.ports:
        click.echo("  none: plug an adapter in")
    if diagnosis.configured:
        click.echo("\nLinks and cars")
    for link in diagnosis.links:
        _print_link(link)
    problems = sum(len(link.problems) for link in diagnosis.links)
    if diagnosis.configured:
        click.echo(f"\n{'all well' if not problems else f'{problems} to mend'}")


def _print_port(port: PortReport) -> None:
    info = port.info
    what = " ".join(x for x in (info.maker, info.product) if x)
    number = f'port = "serial:{info.serial_number}"' if info.serial_number else ""
    parts = [x for x in (what, number, info.by_id) if x]
    if port.users:
        parts.append("in use by " + ", ".join(port.users))
    state = "ok     " if not port.remedy else "problem"
    click.echo(f"  {state} {info.path}" + "".join(f"  {x}" for x in parts))
    if port.remedy:
        click.echo(f"          no permission: {port.remedy}")


def _print_link(link: LinkReport) -> None:
    state = "ok     " if link.ok else "problem"
    line = f"  {state} {link.name}  {link.format}  {link.port}"
    if link.up:
        line += f"  {link.bytes_hz:.0f} bytes/s"
    if link.frames_hz:
        line += f"  {link.frames_hz:.0f} frames/s  {100 * link.damaged_share:.1f} % damaged"
    elif link.up and link.ok and not link.bytes_hz:
        line += "  opens; a car that is not asked says nothing"
    click.echo(line)
    for node in link.nodes:
        name = f"node {node.node}" if node.known else f"device {node.node}"
        parts = [f"IMU {node.imu_hz:.0f} Hz"] if node.imu_hz else []
        parts += [f"positions {node.positions_hz:.0f} Hz"] if node.positions_hz else []
        parts += [f"range to {to} {hz:.1f} Hz" for to, hz in node.ranges_hz.items()]
        if node.missing_share:
            parts.append(f"{100 * node.missing_share:.1f} % missing")
        click.echo(f"          {name}: {', '.join(parts) or 'status only'}")
    for problem in link.problems:
        click.echo(f"          {problem}")
