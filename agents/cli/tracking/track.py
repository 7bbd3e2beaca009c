"""`relpos track`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from agents.cli.console import emit_json, print_table, progress_bar
from agents.cli.options import json_option, out_options
from agents.errors import UsageError

if TYPE_CHECKING:
    from tracking.findings import Finding
    from tracking.log import Log


@click.command()
@click.argument("logs", metavar="LOG [LOG ...]", nargs=-1, required=True, type=Path)
@click.option(
    "--filter",
    "filters",
    multiple=True,
    help="Filter: joint (default), ekf-mds, ekf, paper-ekf-mds or paper-ekf; repeatable.",
)
@click.option(
    "--calibration",
    "calibrations",
    multiple=True,
    type=Path,
    help="calibration.toml that corrects the measurements; repeatable.",
)
@click.option(
    "--smooth",
    type=click.Choice(["lag", "all"]),
    help="Estimates know what was measured in the 0.1 s after them, too (lag), or all that was "
    "measured, before and after (all); joint only.",
)
@click.option(
    "--bound",
    is_flag=True,
    help="Also show the expected errors of an efficient filter; needs truth.",
)
@click.option(
    "--accuracy",
    type=float,
    metavar="METRES",
    help="A pair is ok while it expects to be off by no more, 0.01 to 10; by default 0.3 with a "
    "car, 0.5 without; joint only.",
)
@click.option(
    "--write-noise",
    is_flag=True,
    help="Write the learned noise of ranges to each LOG's meta.toml (range_noise_m), where later "
    "runs take it as given; joint without --smooth only.",
)
@click.option(
    "--no-checks",
    is_flag=True,
    help="Skip the checks of sensors, clocks and ranges.",
)
@click.option(
    "--skip",
    default=10.0,
    show_default=True,
    help="Time after the first range that is not scored [s].",
)
@out_options("report.html and estimates.csv")
@json_option
def track(
    logs: tuple[Path, ...],
    filters: tuple[str, ...],
    calibrations: tuple[Path, ...],
    smooth: Literal["lag", "all"] | None,
    bound: bool,
    accuracy: float | None,
    write_noise: bool,
    no_checks: bool,
    skip: float,
    out: Path | None,
    as_json: bool,
) -> None:
    """Track recorded runs, and score them if they have truth."""
    from agents.evaluation.calibrate import apply_calibrations
    from agents.evaluation.track import TrackResult, track_log
    from agents.output import check_folder
    from agents.warm_up import warm_up_first
    from tracking.filters import DEFAULT_FILTER, filter_builder
    from tracking.filters.joint.params import JointParams
    from tracking.filters.params import FilterParams
    from tracking.findings import refuse_errors
    from tracking.log import write_range_noise
    from tracking.metrics.bound import recorded_bound
    from tracking.tracker import TrackerParams

    _check_numbers(skip, accuracy)
    params = TrackerParams(filter=FilterParams(joint=JointParams(accuracy=accuracy)))
    names = tuple(dict.fromkeys(filters)) or (DEFAULT_FILTER,)
    for name in names:
        filter_builder(name)
    _check_filters(names, smooth, accuracy, write_noise)
    if out is not None:
        check_folder(out, ["report.html"])
    read = [apply_calibrations(_read(path), calibrations) for path in logs]
    needed = names if no_checks else (*names, DEFAULT_FILTER)
    warm_up_first(needed, in_space=any(log.constellation.dimensions == 3 for log in read))
    results: list[TrackResult] = []
    checked = [(log, []) if no_checks else _examined(log) for log in read]
    refuse_errors(
        [
            replace(one, text=f"{path}: {one.text}")
            for path, (_, found) in zip(logs, checked, strict=True)
            for one in found
        ]
    )
    for log, found in checked:
        expected = recorded_bound(log, skip=skip) if bound else None
        for name in names:
            label = f"{log.name}, {name}"
            with progress_bar(label, shown=log.duration > 20.0) as report:
                results.append(
                    track_log(
                        log,
                        filter=name,
                        skip=skip,
                        smooth=smooth,
                        bound=expected,
                        params=params,
                        findings=found,
                        progress=report,
                    )
                )
    texts = {f"{r.log.name}, {f.severity}: {f.text}": None for r in results for f in r.findings}
    click.echo("\n".join(texts), err=True, nl=bool(texts))
    if out is not None:
        _write(out, results)
    if write_noise:
        learned = [r.range_noise for r in results if r.range_noise is not None]
        for path, noise in zip(logs, learned, strict=True):
            write_range_noise(path, noise)
    if as_json:
        emit_json(r.summary for r in results)
        return
    print_tracks(results)
    if out is not None:
        where = "estimates.csv" if len(results) == 1 else "estimates.csv in a folder for each row"
        click.echo(f"\nwritten: {out / 'report.html'} and {where}")


def _read(path: Path) -> Log:
    """Read a log; errors name its folder."""
    from tracking.errors import LogError
    from tracking.log import read_log

    try:
        return read_log(path)
    except LogError as error:
        text = str(error)
        raise LogError(text if text.startswith(f"{path}") else f"{path}: {text}") from error


def _check_filters(
    names: tuple[str, ...], smooth: str | None, accuracy: float | None, write_noise: bool
) -> None:
    from tracking.filters import DEFAULT_FILTER

    if smooth and names != ("joint",):
        raise UsageError(f"--smooth: expected filter joint alone, not {', '.join(names)}")
    if accuracy is not None and DEFAULT_FILTER not in names:
        raise UsageError(f"--accuracy: expected filter joint, not {', '.join(names)}")
    if write_noise and (smooth or DEFAULT_FILTER not in names):
        raise UsageError("--write-noise: expected filter joint without --smooth")


def _check_numbers(skip: float, accuracy: float | None) -> None:
    if not 0.0 <= skip < float("inf"):
        raise UsageError(f"--skip: expected 0 or more seconds, got {skip:g}")
    if accuracy is not None and not 0.01 <= accuracy <= 10.0:
        raise UsageError(f"--accuracy: expected 0.01 to 10 m, got {accuracy:g}")


def _write(out: Path, results: Sequence[Any]) -> None:
    from agents.evaluation.estimates_csv import estimates_csv
    from agents.output import write_results
    from agents.reports.track_report import track_report

    many = len(results) > 1
    files = {"report.html": track_report(results)}
    for k, r in enumerate(results):
        folder = f"{k + 1:02d}-{_file_name(r.log.name)}-{r.filter}/" if many else ""
        files[f"{folder}estimates.csv"] = estimates_csv(r.estimate)
    write_results(out, files)


def print_tracks(results: Sequence[Any]) -> None:
    """Print the errors over all pairs and of each pair."""
    from agents.evaluation.estimates_csv import pair_name
    from agents.evaluation.track import ERRORS
    from agents.reports.page import metres, percent

    rows = []
    for r in results:
        s = r.summary
        head = [f"{s['log']}  {r.method}", "all"]
        rows.append([*head, *(metres(s[k]) for k in ERRORS)])
        if r.expected:
            rows.append(
                [
                    "",
                    "bound of a filter" if r.smooth else "bound",
                    *(metres(r.expected.get(k)) for k in ERRORS),
                ]
            )
        pairs = [p for p, e in enumerate(r.score.pair_rmse) if e == e]
        for p in pairs:
            figures = (r.score.pair_rmse, r.score.pair_rmse_yaw, r.score.pair_rmse_shape)
            name = pair_name(r.log.constellation, p)
            rows.append(["", name, *(metres(float(f[p])) for f in figures)])
    header = ["log and filter", "pair", *ERRORS]
    print_table("Errors of relative positions [m]", header, rows)
    for r in results:
        skipped = ", ".join(f"{n} in {name}" for name, n in r.log.skipped.items()) or "0"
        click.echo(
            f"{r.log.name}, {r.method}: {r.log.n_ranges} ranges in {r.log.duration:.0f} s, "
            f"{r.n_rejected} refused as outliers, bad rows skipped: {skipped}, "
            f"status ok {percent(r.score.ok_share)} of the scored time, ok and wrong "
            f"{percent(r.score.integrity_share, 2)} of the run{_longest(r.score)}, "
            f"{r.realtime_factor:.0f} times faster than real time"
        )
        if r.score.rmse is None:
            click.echo(f"{r.log.name}, {r.filter}: not scored: {_why_not_scored(r)}")


def _why_not_scored(r: Any) -> str:
    if not len(r.log.truth.t):
        return "the log has no truth"
    if r.skip >= r.log.duration:
        return f"--skip leaves out the first {r.skip:g} s, the log has {r.log.duration:.1f} s"
    return f"no estimated pair has truth from {r.skip:g} s after the first range"


def _examined(log: Log) -> tuple[Log, list[Finding]]:
    from tracking.findings import examine

    with progress_bar(f"{log.name}, checks", shown=log.duration > 10.0) as report:
        return examine(log, report)


def _longest(score: Any) -> str:
    worst = score.integrity_worst_s
    return f" (at most {worst:.1f} s in one go)" if worst else ""


def _file_name(name: str) -> str:
    return "".join(ch if ch.isascii() and (ch.isalnum() or ch in "-_") else "_" for ch in name)[:60]
