"""Metrics of the filters on simulated rooms and on recordings.

Run `relpos evaluate --seeds 50 --jobs 2 --out FOLDER`, then this script with the same folder. It
adds cars of the second world (`another_simulator`) and the recordings, and writes
benchmarks/results/tracker-results.jsonl, the input of `benchmarks/make_tables.py`. With
`--others`, it measures the second world and the recordings only, and keeps the rooms.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from another_simulator import SUITE as ANOTHER_SIMULATOR
from cases import RECORDINGS, recording

from agents.evaluation.evaluate import evaluate
from agents.evaluation.track import track_log
from tracking.findings import examine
from tracking.metrics.bound import recorded_bound

FILE = Path(__file__).parent / "results" / "tracker-results.jsonl"
SUITE = (
    "case", "filter", "seeds", "paper", "rmse", "rmse_yaw", "rmse_shape", "bound_yaw",
    "bound_shape", "lost_runs", "ok_share", "integrity_share", "nees",
)  # fmt: skip
"""Fields that are kept of a line of `relpos evaluate`."""
RECORDING = "case", "from", "filter", "rmse", "rmse_yaw", "rmse_shape"
"""Fields that are kept of a recording."""
FIRST = (10.0, 20.0)
"""[s] Recordings are scored from these times on."""
FILTERS = ("joint", "ekf-mds", "ekf")


def suite_lines(folder: Path) -> list[dict[str, Any]]:
    """Return the rounded lines of the rooms of the paper."""
    lines = [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]
    return [rounded(line, SUITE) for line in lines if "lost_runs" in line]


def simulator_lines() -> list[dict[str, Any]]:
    """Return the rounded lines of the second world."""
    found = evaluate(suite=ANOTHER_SIMULATOR, jobs=2)
    return [rounded(line.record, SUITE) for line in found.cases]


def recording_lines() -> list[dict[str, Any]]:
    """Return the lines of the recordings, those of an efficient estimator included."""
    lines = []
    for name in RECORDINGS:
        log, checked = examine(recording(name))
        for skip in FIRST:
            for filter_name in FILTERS:
                found = track_log(log, filter=filter_name, skip=skip, findings=checked)
                line = {"case": name, "from": skip, "filter": filter_name, **found.summary}
                lines.append(rounded(line, RECORDING))
            bound = recorded_bound(log, skip=skip)
            line = {"case": name, "from": skip, "filter": "efficient"}
            line |= {key: float(getattr(bound, key)) for key in RECORDING[3:]}
            lines.append(rounded(line, RECORDING))
    return lines


def rounded(line: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """Return some fields of a line, numbers with five digits."""
    return {
        key: float(f"{line[key]:.5g}") if isinstance(line[key], float) else line[key]
        for key in keys
    }


def kept_lines() -> list[dict[str, Any]]:
    """Return the lines of the rooms of the paper in the present file."""
    lines = [json.loads(line) for line in FILE.read_text().splitlines()]
    return [line for line in lines if "seeds" in line and line["case"] != "another simulator"]


if __name__ == "__main__":
    rooms = kept_lines() if sys.argv[1] == "--others" else suite_lines(Path(sys.argv[1]))
    found = [*rooms, *simulator_lines(), *recording_lines()]
    FILE.write_text("".join(json.dumps(line) + "\n" for line in found))
