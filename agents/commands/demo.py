"""`relpos demo`."""

from __future__ import annotations

from pathlib import Path

import click

from agents.commands.track import print_tracks
from agents.console import emit_json, print_table, progress_bar
from agents.errors import UsageError


@click.command()
@click.option(
    "--scenario",
    default="ring-nlos",
    show_default=True,
    help="cars-los, cars-nlos, ring-los or ring-nlos.",
)
@click.option("--seconds", default=60.0, show_default=True, help="Length, 15 to 3600.")
@click.option("--seed", default=0, show_default=True, help="Same seed, same run.")
@click.option("--cars", default=3, show_default=True, help="Number of cars, 2 or more.")
@click.option("--out", type=Path, default=Path("demo"), show_default=True)
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def demo(scenario: str, seconds: float, seed: int, cars: int, out: Path, as_json: bool) -> None:
    """Cars keep a formation on estimated relative positions; writes report.html."""
    from agents.demo import SETTLE
    from agents.demo import demo as run
    from agents.output import write_results
    from agents.report.demo_report import demo_report

    if not 15.0 <= seconds <= 3600.0:
        raise UsageError(f"--seconds: expected 15 to 3600, got {seconds:g}")
    if seed < 0:
        raise UsageError(f"--seed: expected 0 or more, got {seed}")
    with progress_bar(f"{scenario}, seed {seed}") as report:
        result = run(scenario=scenario, seconds=seconds, seed=seed, cars=cars, progress=report)
    write_results(out, {"report.html": demo_report(result)})
    if as_json:
        emit_json(result.summary)
        return
    print_tracks(result.tracks)
    print_table(
        "Formation error",
        ["the cars are told", f"mean after {SETTLE:.0f} s [m]"],
        [
            ["what the tracker estimates", f"{result.formation_error:.3f}"],
            ["the truth", f"{result.formation_error_truth:.3f}"],
            ["nothing, only the command", f"{result.formation_error_blind:.3f}"],
        ],
    )
    click.echo(
        f"{100 * result.nlos_share:.0f} % of the ranges behind the wall, "
        f"{result.collisions} contacts\nopen {out / 'report.html'} to see the drive"
    )
