"""Exports of a replay: a log folder, MCAP with ROS 2 messages, TUM text."""

from __future__ import annotations

from pathlib import Path

from agents.errors import UsageError
from agents.hardware.replay.result import ReplayResult
from hardware_bridge.exports.log_folder import export_log
from hardware_bridge.exports.mcap import export_mcap
from hardware_bridge.exports.tum import export_tum
from hardware_bridge.exports.whole import whole_folder
from tracking.calibration.file import calibration_toml

EXPORTS = ("log", "mcap", "tum")


def export_replay(result: ReplayResult, out: Path | str, formats: tuple[str, ...]) -> list[Path]:
    """Write a replay in several formats into a new folder; an error leaves no partial export.

    ``log/`` and ``run.mcap`` hold the uncalibrated measurements, ``calibration.toml`` their
    calibration, ``run.mcap`` and ``tum/`` the estimates. Times of the log are seconds since the
    start of the recording, the others UTC.

    Args:
        result: Replay that kept its estimates and measurements.
        out: Folder, new or empty.
        formats: Formats of `EXPORTS`.

    Returns:
        Paths of the written files and folders.

    Raises:
        BridgeError: The folder is not empty or cannot be written, or a format does not support
            the run.
        UsageError: No such format.
    """
    check_formats(formats)
    out = Path(out)
    header, group = result.recording.header, result.config.constellation
    written = []
    with whole_folder(out) as scratch:
        if "log" in formats:
            name = result.config.name or result.recording.path.stem
            source = f"{result.recording.path.name}, {header.software}"
            export_log(scratch / "log", result.block, group, name=name, source=source)
            written.append("log")
        if "mcap" in formats:
            export_mcap(
                scratch / "run.mcap", result.block, group, result.estimate,
                offset_ns=header.wall_ns,
                # Not the configuration, which may hold keys.
                notes={"software": header.software, "recording": result.recording.path.name},
            )  # fmt: skip
            written.append("run.mcap")
        if "tum" in formats:
            export_tum(scratch / "tum", result.estimate, offset_ns=header.wall_ns)
            written.append("tum")
        if result.calibration is not None:
            text = calibration_toml(result.calibration)
            (scratch / "calibration.toml").write_text(text, encoding="utf-8")
            written.append("calibration.toml")
    return [out / name for name in written]


def check_formats(formats: tuple[str, ...]) -> None:
    """Check the names of formats.

    Raises:
        UsageError: A format is unknown.
    """
    for name in formats:
        if name not in EXPORTS:
            raise UsageError(f"--export: expected {', '.join(EXPORTS)}, got {name}")
