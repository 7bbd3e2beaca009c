"""`relpos emulate`."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import cars_option, json_option, scenario_option, task_option
from agents.errors import UsageError


@click.command()
@click.option(
    "--out",
    type=Path,
    required=True,
    help="Folder for the ports and, once they are ready, swarm.toml, or with own trackers "
    "swarm-1.toml and so on.",
)
@scenario_option("; by default that of the task.")
@task_option
@cars_option
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same world."
)
@click.option(
    "--seconds",
    default=60.0,
    show_default=True,
    help="Length from the release of the cars, 0.1 to 86400 [s]; Ctrl-C or SIGTERM ends "
    "it earlier.",
)
@click.option(
    "--trackers",
    type=click.Choice(["group", "own"]),
    default="group",
    show_default=True,
    help="own: each node also sends what its radio received of the others, for `relpos drive "
    "--node` on each car; without an operator.",
)
@click.option(
    "--format",
    default="relpos",
    show_default=True,
    help="Serial format of the nodes: relpos, linktrack, uwb-core, dw1000 or dwm1001.",
)
@click.option(
    "--imu-format",
    metavar="NAME",
    help="Serial format of second ports.  [default: witmotion where the first has no IMU]",
)
@click.option(
    "--driver", default="relpos", show_default=True, help="Driver of the cars: relpos, vesc or pwm."
)
@click.option(
    "--key",
    metavar="HEX",
    help="Key of 16 bytes, in hex or as @FILE, that signs messages in the format relpos.",
)
@click.option(
    "--proximity", default=0, show_default=True, help="Number of distance sensors on each car."
)
@click.option(
    "--deadman",
    type=float,
    help="Time without a command after which a car stops itself [s].  [default: 0.2]",
)
@click.option("--no-operator", is_flag=True, help="Leave out the simulated operator.")
@click.option("--faults", type=Path, help="TOML file of faults; see docs/how-to/emulator.md.")
@click.option(
    "--wait",
    default=0.0,
    show_default=True,
    help="Longest wait for the first command of a host before the world moves [s].",
)
@click.option("--log", type=Path, help="New log folder with the truth.")
@json_option
def emulate(
    out: Path,
    key: str | None,
    no_operator: bool,
    faults: Path | None,
    wait: float,
    log: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Emulate nodes and cars of a simulated world behind serial ports, in real time."""
    from agents.hardware.emulate import EmulatedRig, EmulateOptions
    from agents.hardware.emulate import emulate as run
    from hardware_bridge.emulator.fault_plan import FaultPlan, read_faults

    chosen = EmulateOptions(
        key=_key(key),
        operator=not no_operator,
        faults=FaultPlan() if faults is None else read_faults(faults),
        **options,
    )

    def ready(rig: EmulatedRig) -> None:
        record = {"result": "ready", "folder": str(rig.folder), "ports": sorted(rig.ports)}
        if as_json:
            emit_json([record])
            return
        parts = rig.world.parts
        click.echo(
            f"{parts.scenario.name}, task {parts.config.task}, seed {chosen.seed}: "
            f"{parts.n_cars} cars with {chosen.driver}, nodes send "
            f"{' and '.join(f.name for f in chosen.formats())}\n"
            f"ports {', '.join(rig.ports)} and swarm.toml in {rig.folder}"
        )

    # SIGTERM, as sent to background processes, must also remove the ports.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    result = run(
        folder=out,
        options=chosen,
        wait=wait,
        log=log,
        ready=ready,
        report=(lambda record: emit_json([record])) if as_json else None,
    )
    if as_json:
        emit_json([{"result": "line", **line} for line in result.lines])
        emit_json([result.summary])
        return
    names = ("frames", "lost", "damaged", "bytes", "dropped", "unread", "read")
    print_table(
        "Lines",
        ["line", *names],
        [[line["line"], *(str(line[name]) for name in names)] for line in result.lines],
    )
    click.echo(
        "frames: said by the devices; lost, damaged: on the way, as --faults asks; dropped: "
        "no room;\nunread: bytes while nothing had the port open; read: bytes of commands"
    )
    late = result.lateness
    error = result.summary["formation_error"]
    click.echo(
        f"{result.seconds:.1f} s, formation error "
        f"{'unknown' if error is None else f'{error:.3f} m'}, {result.collisions} collisions, "
        f"{len(result.happened)} faults\n"
        f"{late.late} of {late.steps} steps late, the latest by {1e-6 * late.worst_ns:.1f} ms"
    )


def _key(text: str | None) -> bytes | None:
    from hardware_bridge.wire.key import read_key

    try:
        return read_key(text)
    except ValueError as error:
        raise UsageError(f"--key: {error}") from error
