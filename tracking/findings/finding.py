"""Kinds of findings about recordings, in one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from tracking.errors import LogError

Severity = Literal["error", "warning", "note"]


class Kind(NamedTuple):
    """One kind of finding."""

    severity: Severity
    """Effect on estimates: wrong while `ok` (error), less accurate than possible (warning), or
    neither (note)."""
    meaning: str
    remedy: str


KINDS: dict[str, Kind] = {
    "accel-units": Kind(
        "error", "accelerations are not in m/s2", "multiply them, or calibrate the IMU"
    ),
    "gravity-axis": Kind(
        "error",
        "gravity is not on +z of a vehicle that stays level",
        "turn the IMU, or say how it is mounted: `imu_axes` of the node; x forward, y left, z up",
    ),
    "gravity-tilt": Kind(
        "warning",
        "the IMU of a vehicle that stays level is tilted",
        "mount it flat: its tilt is taken for an acceleration",
    ),
    "gravity-length": Kind(
        "warning", "an IMU at rest reads too much or too little", "`relpos calibrate imu`"
    ),
    "gyro-bias": Kind(
        "warning",
        "a gyroscope at rest reads a rotation, which is taken off a recording",
        "`relpos calibrate imu`",
    ),
    "gyro-units": Kind("error", "angular rates are not in rad/s", "multiply them by pi / 180"),
    "gyro-axes": Kind(
        "error",
        "gyroscope and magnetometer of a node have different axes or signs",
        "say how they are mounted: `imu_axes`, `mag_axes` of the node; x forward, y left, z up",
    ),
    "mag-turned": Kind(
        "warning",
        "the magnetometer of a level vehicle is turned about the vertical; it is turned back",
        "mount it along the axes of the IMU, or calibrate it again where the vehicle drives",
    ),
    "clock-offset": Kind(
        "error",
        "an IMU has another clock than the ranges, by more than is corrected",
        "stamp both on one clock",
    ),
    "clock-corrected": Kind(
        "warning",
        "an IMU is stamped too late or too early; its samples are moved",
        "stamp both on one clock",
    ),
    "clock-rate": Kind(
        "error",
        "an IMU has a clock that runs faster or slower than that of the ranges",
        "stamp both on one clock",
    ),
    "imu-contradicts": Kind(
        "error",
        "the motion that an IMU reports is not the one that ranges show",
        "look for its axes (x forward, y left, z up), its clock, its calibration, or another "
        "node's IMU under its id",
    ),
    "range-offset": Kind(
        "warning", "ranges are longer or shorter than fits", "`relpos calibrate uwb`"
    ),
    "range-scale": Kind(
        "warning", "ranges are longer by a factor than surveyed distances", "`relpos calibrate uwb`"
    ),
    "never-still": Kind(
        "note",
        "a node never rests, so the bias of its gyroscope is not known at first",
        "leave it alone for two seconds before it moves",
    ),
    "bad-stamps": Kind(
        "note",
        "times of IMU samples repeat or jitter; rotations add up to the time that passed",
        "stamp samples when they are taken, on the device",
    ),
    "no-imu": Kind(
        "note",
        "ranges alone determine neither the rotation nor the reflection of a group, and of three "
        "nodes not the side of one without an IMU",
        "record the IMU",
    ),
    "no-heading": Kind(
        "note",
        "an initial heading that is not given is taken for 0",
        "`initial_heading_rad` in meta.toml",
    ),
    "no-magnetometer": Kind(
        "note",
        "an IMU without a magnetometer is not used where the heading is magnetic",
        '`heading = "initial"` in meta.toml',
    ),
    "unused-keys": Kind(
        "warning",
        "meta.toml has keys that are not read, such as misspelt ones",
        "correct or remove them: `docs/reference/log-format.md`",
    ),
    "truth-clock": Kind(
        "warning",
        "the truth is on another clock than the ranges, so errors are wrong, or nothing is scored",
        "stamp both on one clock",
    ),
    "truth-nodes": Kind(
        "warning",
        "ranges fit better if the truth of two nodes is exchanged",
        "correct the ids in truth.csv",
    ),
    "truth-scale": Kind(
        "warning",
        "ranges and true distances differ by a factor",
        "`relpos calibrate uwb`, or correct the unit of ranges.csv or truth.csv",
    ),
    "ranges-refused": Kind(
        "warning",
        "the filter refused many ranges as outliers: they are worse than it assumes",
        "look for reflections and calibration; estimates of such a recording are not to be used",
    ),
    "degenerate-layout": Kind(
        "note",
        "a layout near a line (in space: a plane) is its own mirror image, so its side stays open",
        "place a node off the line, or drive until the group leaves it",
    ),
    "degenerate-motion": Kind(
        "warning",
        "a node that moves along a line (in space: in a plane) fits two mirror images of the rest",
        "move it off that line or plane too: up and down for seconds, if it is a plane",
    ),
    "undecided-layout": Kind(
        "note",
        "the measured motion did not tell a layout from its mirror image or its rotations",
        "let more nodes with an IMU move, longer and in curves; calibrate ranges and IMU; "
        "`rmse_mirror` judges the shape meanwhile",
    ),
    "never-placed": Kind("note", "a node was never placed", "range it with more of the others"),
}
"""Kinds by name, as in `docs/reference/findings.md`."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding."""

    name: str
    """Name in `KINDS`."""
    nodes: tuple[int, ...]
    """Ids of the nodes concerned; empty for the whole group."""
    text: str
    """The found and the expected, in one line."""

    @property
    def severity(self) -> Severity:
        """Severity of its kind."""
        return KINDS[self.name].severity

    @property
    def record(self) -> dict[str, Any]:
        """Finding as a dictionary for JSON."""
        return {
            "name": self.name,
            "severity": self.severity,
            "nodes": list(self.nodes),
            "text": self.text,
            "remedy": KINDS[self.name].remedy,
        }


def refuse_errors(findings: Sequence[Finding]) -> None:
    """Raise an error for findings with which estimates would be wrong while `ok`.

    Raises:
        LogError: There is such a finding; the message lists all of them.
    """
    errors = [f"{f.text}; {KINDS[f.name].remedy}" for f in findings if f.severity == "error"]
    if errors:
        raise LogError("\n".join(errors))


def names(ids: Sequence[int]) -> str:
    """Return a text of node ids: "node 3", "nodes 1, 2"."""
    return f"node{'s' if len(ids) > 1 else ''} {', '.join(str(i) for i in ids)}"
