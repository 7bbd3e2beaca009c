"""Learning curves of training runs: records in one file, and a figure of that file.

python benchmarks/draw_learning_curves.py RUN ...    collects intervals.jsonl of runs, then draws
python benchmarks/draw_learning_curves.py            draws results/learning-curves.jsonl again
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from agents.reports.style import svg
from agents.reports.train_report import curves
from agents.training.run_folder import LOG, RunFolder

ROOT = Path(__file__).resolve().parents[1]
ROWS = ROOT / "benchmarks" / "results" / "learning-curves.jsonl"
PICTURE = ROOT / "docs" / "images" / "learning-curves.svg"


def collect(folders: list[Path]) -> list[dict[str, Any]]:
    """Return the records of all runs, each with task, observation mode and seed."""
    rows = []
    for folder in folders:
        config = RunFolder(folder).config()
        env = config.env
        which = {"task": env.task, "trained_on": env.observation, "seed": config.seed}
        lines = (folder / LOG).read_text().splitlines()
        rows += [{**which, **json.loads(line)} for line in lines]
    return rows


def draw(rows: list[dict[str, Any]]) -> bytes:
    """Return the figure: one line per run, one colour per task and observation mode."""
    runs: dict[tuple[str, int], list[dict[str, Any]]] = {}
    for row in rows:
        label = f"{row['task']}, on {row['trained_on']}"
        runs.setdefault((label, row["seed"]), []).append(row)
    return svg(curves([(label, run) for (label, _), run in runs.items()]))


if __name__ == "__main__":
    if sys.argv[1:]:
        found = collect([Path(name) for name in sys.argv[1:]])
        ROWS.write_text("".join(json.dumps(row) + "\n" for row in found))
    PICTURE.write_bytes(draw([json.loads(line) for line in ROWS.read_text().splitlines()]))
