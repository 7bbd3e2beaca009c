"""`relpos demo-hardware`."""

from __future__ import annotations

import signal
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
    task_option,
)
from agents.errors import UsageError


@click.command("demo-hardware")
@scenario_option(".", default="cars-nlos")
@task_option
@click.option(
    "--seconds", default=40.0, show_default=True, help="Length of a drive, 15 to 3600 [s]."
)
@click.option("--seed", default=0, show_default=True, help="Seed of the first drive.")
@click.option(
    "--drives", default=1, show_default=True, help="Number of drives, one after the other."
)
@cars_option
@policy_option
@click.option(
    "--controller",
    metavar="NAME",
    help="Controller that drives: consensus, leader-follower, range-only or weaving.  "
    "[default: consensus]",
)
@click.option(
    "--format",
    default="relpos",
    show_default=True,
    help="Serial format of the nodes: relpos, linktrack, uwb-core, dw1000 or dwm1001.",
)
@click.option(
    "--driver", default="relpos", show_default=True, help="Driver of the cars: relpos, vesc or pwm."
)
@click.option("--faults", type=Path, help="TOML file of faults; see docs/how-to/emulator.md.")
@click.option(
    "--virtual", is_flag=True, help="Run in memory under a virtual clock, as fast as possible."
)
@out_options("report.html", default=Path("demo-hardware"))
@json_option
def demo_hardware(
    seed: int,
    drives: int,
    policy: str | None,
    controller: str | None,
    faults: Path | None,
    virtual: bool,
    out: Path,
    as_json: bool,
    **options: Any,
) -> None:
    """Drive emulated cars through the whole stack down to serial bytes; writes report.html.

    With --virtual, the bytes are exchanged in memory, without ports and processes: about five times
    faster than real time, and reproducible.
    """
    from agents.hardware.demo import hardware_demo
    from agents.hardware.emulate import EmulateOptions
    from agents.output import check_folder, write_results
    from agents.reports.hardware_report import HEADER, demo_rows, hardware_report, ratio_record
    from hardware_bridge.emulator.fault_plan import FaultPlan, read_faults

    if policy is not None and controller is not None:
        raise UsageError("--policy: expected either a policy or a --controller, got both")
    if not 15.0 <= options["seconds"] <= 3600.0:
        raise UsageError(f"--seconds: expected 15 to 3600, got {options['seconds']:g}")
    if not 1 <= drives <= 1000:
        raise UsageError(f"--drives: expected 1 to 1000, got {drives}")
    check_folder(out, ["report.html"])
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # clean up on termination
    plan = FaultPlan() if faults is None else read_faults(faults)
    results = []
    for each in range(seed, seed + drives):
        chosen = EmulateOptions(seed=each, faults=plan, **options)
        with progress_bar(f"{chosen.task}, seed {each}") as report:
            name = policy or controller or "consensus"
            result = hardware_demo(options=chosen, name=name, virtual=virtual, progress=report)
            results.append(result)
        if as_json:
            emit_json([results[-1].summary])
    room = chosen.parts().scenario.room
    write_results(out, {"report.html": hardware_report(results, room)})
    if as_json:
        if drives > 1:
            emit_json([ratio_record(results)])
        return
    print_table(
        "Formation error through the bridge and in the simulator", HEADER, demo_rows(results)
    )
    for result in results:
        for stop in result.drive.stops:
            click.echo(f"seed {result.seed}: {stop}")
    click.echo(f"open {out / 'report.html'} to see the drive")
