"""The rows of `measure_ablation.py` as tables in Markdown, one for each group of runs."""

from __future__ import annotations

import json
from typing import Any

CAPTIONS = {
    "": "Runs from the start on, and two recordings:",
    "late": "Runs whose tracker begins 12 to 18 s later, while everything moves; robots are the "
    "same cars, of which no wheels are known:",
    "exact": "Groups that begin in motion, in numberings and at rates drawn at random: three "
    "robots with 5 cm of noise on ranges, five hands and drones with exact measurements:",
    "gliding": "Groups of three of which two go straight on at a constant velocity after 10 s:",
    "convoy": "Vehicles that follow each other:",
    "world": "The second world (`tests/second_world`, mounts unknown):",
    "cars-nlos": "Cars of which one is at fault from 25 s on: ranges 0.6 m too long (offset), half "
    "of them random (outliers), all of them (made up), no range for 3 s (silent), one pair that "
    "repeats a range for 10 s (frozen), an IMU that falls silent for good (dead IMU), one that "
    "repeats a reading for 5 s (stuck IMU), 1 % of IMU readings random (IMU spikes), an "
    "accelerometer that reads at most 3 m/s2 (cut off):",
    "drones": "Drones with the same faults:",
}
"""Group of runs to the sentence before its table."""


def tables(lines: list[str]) -> str:
    """Tables of rows as JSON lines, each after its caption."""
    rows = [json.loads(line) for line in lines]
    names = list(dict.fromkeys(row["without"] for row in rows))
    found = {(row["without"], row["kind"]): row for row in rows}
    groups: dict[str, list[str]] = {}
    for kind in dict.fromkeys(row["kind"] for row in rows):
        groups.setdefault(group_of(kind), []).append(kind)
    parts = []
    for group, kinds in groups.items():
        head = ["without", *kinds]
        text = [head, ["---"] * len(head)]
        for name in names:
            cells = [cell(found[name, k]) for k in kinds]
            if set(cells) != {"="}:
                text.append([name or "all of them", *cells])
        table = "\n".join("| " + " | ".join(row) + " |" for row in text)
        parts.append(f"{CAPTIONS[group]}\n\n{table}\n")
    return "\n".join(parts)


def group_of(kind: str) -> str:
    """Name of the table that a kind of run is a column of."""
    first, fault = kind.split(" ")[0], kind.partition(", ")[2]
    if fault:
        return first.rstrip(",")
    return first if first in ("late", "exact", "gliding", "convoy", "world") else ""


def cell(row: dict[str, Any]) -> str:
    """One figure: errors [m] of the whole filter, else their ratio to it; shares wrong and ok."""
    shares = f"{100.0 * row['wrong']:.2g} of {100.0 * row['ok']:.0f} %"
    if not row["without"]:
        return f"{row['yaw']:.3f} / {row['shape']:.3f} m; {shares}"
    if not row["changed"]:
        return "="
    (yaw, low, high), (shape, *_) = row["yaw"], row["shape"]
    if row["runs"] == 1:
        return f"{yaw:.2f} / {shape:.2f}; {shares}"
    return f"{yaw:.2f} ({low:.2f}-{high:.2f}) / {shape:.2f}; {shares}"
