"""Table of algorithms of BenchMARL on the tasks of protocol 1, next to a controller."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.stats import bootstrap

from tables.markdown import markdown
from tables.measured import measured

COLUMNS = {"mappo": "MAPPO", "ippo": "IPPO", "masac": "MASAC", "qmix": "QMIX"}
CONTROLLER = "consensus"


def algorithms() -> str:
    """Return mean formation errors over seeds with 95 % bootstrap intervals [m]."""
    errors: dict[tuple[str, str], list[float]] = defaultdict(list)
    for line in measured("algorithms"):
        error = float(np.nanmean(line["metrics"]["formation_error"]))
        errors[line["task"], line["algorithm"]].append(error)
    tasks = dict.fromkeys(task for task, _ in errors)
    rows = []
    for task in tasks:
        cells = [_cell(errors[task, name]) for name in COLUMNS]
        rows.append((f"`{task}`", f"{errors[task, CONTROLLER][0]:.2f}", *cells))
    return markdown(("task", CONTROLLER, *COLUMNS.values()), rows, right="rest")


def _cell(values: list[float]) -> str:
    mean = np.mean(values)
    if len(values) < 3:
        return f"{mean:.2f} (of {len(values)})"
    low, high = bootstrap((values,), np.mean, rng=0, method="basic").confidence_interval
    return f"{mean:.2f} ({low:.2f} to {high:.2f}, of {len(values)})"
