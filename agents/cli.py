"""The command line `relpos`. Imports of a command happen when it runs, so that help is quick."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from agents.console import emit_json, print_table, progress_bar
from agents.errors import UsageError


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="relpos-env", prog_name="relpos")
def cli() -> None:
    """Relative positions without anchors: track, simulate, drive in formation, measure."""


def main() -> None:
    """Run the command line; what a user can mend ends in one line and status 2."""
    from relpos_env.errors import EnvError
    from tracking.errors import TrackingError

    try:
        cli(standalone_mode=False)
    except click.exceptions.Abort:
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(1)
    except (TrackingError, EnvError, UsageError, OSError) as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(2)


@cli.command()
@click.argument("logs", metavar="LOG [LOG ...]", nargs=-1, required=True, type=Path)
@click.option(
    "--filter", "filters", multiple=True, help="ekf or ekf-mds (default); may be given again."
)
@click.option("--skip", default=10.0, show_default=True, help="Seconds that are not scored.")
@click.option("--out", type=Path, help="Folder for estimates.csv and report.html.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def track(
    logs: tuple[Path, ...], filters: tuple[str, ...], skip: float, out: Path | None, as_json: bool
) -> None:
    """Track recorded runs and score them where they have truth."""
    from agents.report.track_report import track_report
    from agents.track import estimates_csv, track_log
    from tracking.filters import DEFAULT_FILTER, filter_builder
    from tracking.log import read_log

    if not 0.0 <= skip < float("inf"):
        raise UsageError(f"--skip: expected 0 or more seconds, got {skip:g}")
    names = tuple(dict.fromkeys(filters)) or (DEFAULT_FILTER,)
    for name in names:
        filter_builder(name)
    read = [read_log(path) for path in logs]
    results = []
    for log in read:
        for name in names:
            label = f"{log.name}, {name}"
            with progress_bar(label, shown=log.duration > 20.0) as report:
                results.append(track_log(log, filter=name, skip=skip, progress=report))
    if out is not None:
        from agents.output import write_results

        many = len(results) > 1
        files = {"report.html": track_report(results)}
        for k, r in enumerate(results):
            folder = f"{k + 1:02d}-{_file_name(r.log.name)}-{r.filter}/" if many else ""
            files[f"{folder}estimates.csv"] = estimates_csv(r.estimate)
        write_results(out, files)
    if as_json:
        emit_json(r.summary for r in results)
        return
    _print_tracks(results)
    if out is not None:
        click.echo(f"\nwritten: {out / 'report.html'} and estimates.csv")


@cli.command()
@click.argument("out", type=Path)
@click.option(
    "--scenario",
    default="cars-nlos",
    show_default=True,
    help="cars-los, cars-nlos, ring-los or ring-nlos.",
)
@click.option("--seconds", default=120.0, show_default=True, help="Length, 3 to 86400.")
@click.option("--seed", default=0, show_default=True, help="Same seed, same run.")
@click.option("--cars", default=3, show_default=True, help="Number of cars, 2 or more.")
@click.option("--channel", help="Radio: calibrated (default), indoor, hall, outdoor or exact.")
@click.option("--antenna-delay", type=float, help="Uncalibrated antennas: std in metres.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def simulate(out: Path, as_json: bool, **options: Any) -> None:
    """Record a simulated drive as a log folder with truth."""
    from agents.simulate import simulate as run

    with progress_bar(f"{options['scenario']}, seed {options['seed']}") as report:
        log = run(out=out, progress=report, **options)
    nlos = float(log.nlos.mean()) if log.nlos is not None and len(log.nlos) else 0.0
    record = {
        "log": log.name,
        "out": str(out),
        "nodes": log.constellation.n_nodes,
        "duration_s": log.duration,
        "ranges": log.n_ranges,
        "nlos_share": nlos,
    }
    if as_json:
        emit_json([record])
    else:
        click.echo(
            f"{out}: {record['nodes']} nodes, {log.duration:.0f} s, {log.n_ranges} ranges, "
            f"{100 * nlos:.0f} % of them behind an obstacle"
        )


@cli.command()
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
    _print_tracks(result.tracks)
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


@cli.command()
@click.option("--events", default=200, show_default=True, help="Of each kind, for each mode.")
@click.option(
    "--nodes", default="3,4,5,6,10,20,50", show_default=True, help="Sizes of groups, 2 to 62."
)
@click.option("--seed", default=0, show_default=True, help="Same seed, same figures.")
@click.option("--out", type=Path, help="Folder for report.html and the pictures in it.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def protocol(events: int, nodes: str, seed: int, out: Path | None, as_json: bool) -> None:
    """Measure the ranging protocol: rate, recovery when nodes come and go, clock errors."""
    from agents.output import check_folder, write_results
    from agents.protocol.experiment import protocol as run
    from agents.report import protocol_report as report
    from agents.report.page import png

    try:
        sizes = tuple(int(n) for n in nodes.split(","))
    except ValueError:
        raise UsageError(f"--nodes: expected numbers such as 3,6,10, got {nodes!r}") from None
    if out is not None:
        check_folder(out, ["report.html", *report.PICTURES])
    with progress_bar("protocol") as tell:
        result = run(events=events, nodes=sizes, seed=seed, progress=tell)
    if out is not None:
        figures = report.figures(result)
        pictures = {name: png(figure) for name, figure in figures.items()}
        write_results(out, {"report.html": report.protocol_report(result, figures), **pictures})
    if as_json:
        emit_json(result.records)
        return
    print_table("Rate", report.RATE_HEADER, report.rate_rows(result))
    print_table("Recovery", report.RECOVERY_HEADER, report.recovery_rows(result))
    print_table("Range errors by clocks", report.CLOCK_HEADER, report.clock_rows(result))
    if out is not None:
        click.echo(f"written: {out / 'report.html'}")


@cli.group()
def bench() -> None:
    """Measure speed, each figure beside a peer in the same run."""


@bench.command("tracker")
@click.option("--rounds", default=2000, show_default=True, help="Ranging rounds per figure.")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def bench_tracker(rounds: int, as_json: bool) -> None:
    """Microseconds per ranging round, beside filterpy doing the same pair updates."""
    from agents.bench.tracker import bench_tracker as run

    if rounds < 100:
        raise UsageError(f"--rounds: expected at least 100, got {rounds}")
    with progress_bar("tracker") as report:
        rows = run(rounds=rounds, progress=report)
    _show_bench("Time of one ranging round", rows, as_json)


@bench.command("radio")
@click.option("--json", "as_json", is_flag=True, help="JSON lines on stdout, nothing else.")
def bench_radio(as_json: bool) -> None:
    """Microseconds per message-level round in a batch, beside the reference session."""
    from agents.bench.radio import bench_radio as run

    with progress_bar("radio") as report:
        rows = run(progress=report)
    _show_bench("Time of one message-level round", rows, as_json)


def _show_bench(title: str, rows: list[dict[str, Any]], as_json: bool) -> None:
    if as_json:
        emit_json(rows)
        return
    header = ["case", "value", "unit", "peer", "peer value", "ratio"]
    figures = [(f"{r['value']:.2f}", f"{r['peer_value']:.1f}", f"{r['ratio']:.0f}") for r in rows]
    cells = [
        [r["case"], value, r["unit"], r["peer"], peer, ratio]
        for r, (value, peer, ratio) in zip(rows, figures, strict=True)
    ]
    print_table(title, header, cells)


def _print_tracks(results: Sequence[Any]) -> None:
    """Errors over all pairs and for each of them."""
    from agents.report.page import metres
    from agents.track import pair_name

    rows = []
    for r in results:
        s = r.summary
        head = [f"{s['log']}  {s['filter']}", "all"]
        rows.append([*head, *(metres(s[k]) for k in ("rmse", "rmse_yaw", "rmse_shape"))])
        pairs = [p for p, e in enumerate(r.score.pair_rmse) if e == e]
        for p in pairs:
            figures = (r.score.pair_rmse, r.score.pair_rmse_yaw, r.score.pair_rmse_shape)
            name = pair_name(r.log.constellation, p)
            rows.append(["", name, *(metres(float(f[p])) for f in figures)])
    header = ["log and filter", "pair", "rmse", "rmse_yaw", "rmse_shape"]
    print_table("Errors of relative positions [m]", header, rows)
    for r in results:
        skipped = ", ".join(f"{n} in {name}" for name, n in r.log.skipped.items()) or "0"
        click.echo(
            f"{r.log.name}, {r.filter}: {r.log.n_ranges} ranges in {r.log.duration:.0f} s, "
            f"{r.n_rejected} refused as outliers, bad rows skipped: {skipped}, "
            f"status ok {100 * r.score.ok_share:.0f} % of the scored time, "
            f"{r.realtime_factor:.0f} times faster than real time"
        )
        if r.score.rmse is None:
            reason = (
                "there is no truth"
                if not len(r.log.truth.t)
                else (f"no estimated pair has truth from {r.skip:g} s after the first range")
            )
            click.echo(f"{r.log.name}, {r.filter}: no errors, since {reason}")


def _file_name(name: str) -> str:
    return "".join(ch if ch.isascii() and (ch.isalnum() or ch in "-_") else "_" for ch in name)[:60]
