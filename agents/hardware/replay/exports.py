"""A replayed run in the formats of others: a log folder, MCAP with ROS 2 messages, TUM text."""

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
    """Write all of them into a new folder, or nothing.

    ``log/`` and ``run.mcap`` have the measurements as they came, ``calibration.toml`` what
    corrects them; ``run.mcap`` and ``tum/`` the estimates. Times of the log are seconds since the
    start of the recording, the others UTC.

    Args:
        result: Of a replay that kept its estimates and measurements.
        out: New or empty.
        formats: Of `EXPORTS`.

    Returns:
        What was written.

    Raises:
        BridgeError: The folder is taken or cannot be written, or the run does not make one of
            the formats.
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
    """See that there are such formats, before any work is done for them.

    Raises:
        UsageError: There is one that is none.
    """
    for name in formats:
        if name not in EXPORTS:
            raise UsageError(f"--export: expected {', '.join(EXPORTS)}, got {name}")
