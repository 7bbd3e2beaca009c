"""`relpos calibrate`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from agents.cli.console import emit_json, print_table
from agents.cli.options import json_option, out_options
from agents.errors import UsageError

if TYPE_CHECKING:
    from agents.evaluation.calibrate import CalibrateResult

FILES = ("calibration.toml", "report.html")


def _shared(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command with the arguments shared by all calibrations."""
    for decorate in (
        json_option,
        out_options("calibration.toml and report.html", required=True),
        click.argument("log", type=Path),
    ):
        function = decorate(function)
    return function


@click.group()
def calibrate() -> None:
    """Calibrate sensors from a recorded run, for `relpos track --calibration`."""


@calibrate.command("imu")
@_shared
@click.option(
    "--assume-level", is_flag=True, help="Assume that nodes are level whenever they are at rest."
)
@click.option(
    "--gravity",
    default=9.81,
    show_default=True,
    help="Gravity at the place of the recording [m/s2].",
)
def imu(log: Path, out: Path, as_json: bool, assume_level: bool, gravity: float) -> None:
    """Estimate gyroscope and accelerometer offsets at rest."""
    from agents.evaluation.calibrate import calibrate_imus
    from agents.reports.calibration_report import IMU_HEADER, imu_rows
    from tracking.log import read_log

    if not 9.7 <= gravity <= 9.9:
        raise UsageError(f"--gravity: expected 9.7 to 9.9 m/s2, got {gravity:g}")
    result = calibrate_imus(read_log(log), level=assume_level, gravity=gravity)
    if not _finish(result, out, as_json):
        print_table("Offsets at rest", IMU_HEADER, imu_rows(result))
        _tell(result, out)


@calibrate.command("mag")
@_shared
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same result."
)
def mag(log: Path, out: Path, as_json: bool, seed: int) -> None:
    """Estimate hard and soft iron of magnetometers from rotations in place."""
    from agents.evaluation.calibrate import calibrate_magnetometers
    from agents.reports.calibration_report import MAG_HEADER, mag_rows
    from tracking.log import read_log

    _check_seed(seed)
    result = calibrate_magnetometers(read_log(log), seed=seed)
    if not _finish(result, out, as_json):
        print_table("Hard and soft iron", MAG_HEADER, mag_rows(result))
        _tell(result, out)


@calibrate.command("uwb")
@_shared
@click.option(
    "--seed", default=0, show_default=True, help="Seed; the same seed gives the same result."
)
@click.option(
    "--max-distance", default=8.0, show_default=True, help="Longest range that is used [m]."
)
def uwb(log: Path, out: Path, as_json: bool, seed: int, max_distance: float) -> None:
    """Estimate slope and antenna delays of ranges against truth."""
    from agents.evaluation.calibrate import calibrate_ranges
    from agents.reports.calibration_report import UWB_HEADER, uwb_rows, uwb_text
    from tracking.log import read_log

    _check_seed(seed)
    if not 0.0 < max_distance < float("inf"):
        raise UsageError(f"--max-distance: expected more than 0 m, got {max_distance:g}")
    result = calibrate_ranges(read_log(log), seed=seed, max_distance=max_distance)
    if not _finish(result, out, as_json):
        print_table("Antenna delays", UWB_HEADER, uwb_rows(result))
        click.echo(uwb_text(result))
        _tell(result, out)


def _finish(result: CalibrateResult, out: Path, as_json: bool) -> bool:
    """Write the files, and print JSON if requested; return `as_json`."""
    from agents.output import write_results
    from agents.reports.calibration_report import calibration_report
    from tracking.calibration import calibration_toml

    texts = (calibration_toml(result.calibration), calibration_report(result))
    write_results(out, dict(zip(FILES, texts, strict=True)))
    if as_json:
        emit_json(result.summary)
    return as_json


def _tell(result: CalibrateResult, out: Path) -> None:
    from agents.reports.calibration_report import refusals

    for line in refusals(result):
        click.echo(line)
    click.echo(f"written: {' and '.join(str(out / name) for name in FILES)}")


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**32:
        raise UsageError(f"--seed: expected 0 to {2**32 - 1}, got {seed}")
