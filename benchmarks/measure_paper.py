"""Effect of each interpretation of the paper's text, for `docs/explanation/paper.md`.

`paper-ekf-mds` with one option changed at a time on the three cases of the paper suite; medians
over the seeds. With "layout given" the first MDS is aligned to the true layout, which is unknown to
filters, since the text does not specify the initialisation.

Run `python benchmarks/measure_paper.py [FIRST SEED] [SEEDS] [SECONDS]`; 0, 20 and 60 by default.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from agents.evaluation.suites import PAPER
from tracking import Tracker, TrackerParams
from tracking.filters import FilterParams
from tracking.filters.paper import PaperParams
from tracking.log import Log
from tracking.metrics.score import Score, score

FIGURES = ("rmse_yaw", "rmse_shape", "rmse_mirror", "integrity_share")
READINGS: dict[str, tuple[str, dict[str, object], bool]] = {
    "the text, literally": ("paper-ekf-mds", {}, False),
    "EKF only": ("paper-ekf", {}, False),
    "layout given": ("paper-ekf-mds", {}, True),
    "EKF only, layout given": ("paper-ekf", {}, True),
    "speed: rate": ("paper-ekf-mds", {"speed": "rate"}, False),
    "speed: rate, layout given": ("paper-ekf-mds", {"speed": "rate"}, True),
    "feedback: update": ("paper-ekf-mds", {"feedback": "update"}, False),
    "feedback: update, speed: rate, layout given": (
        "paper-ekf-mds",
        {"feedback": "update", "speed": "rate"},
        True,
    ),
    "alignment: none": ("paper-ekf-mds", {"alignment": "none"}, False),
    "scaling: fourth-root": ("paper-ekf-mds", {"scaling": "fourth-root"}, False),
}
"""Name to filter, options, and True if the first layout is given."""


def track(log: Log, filter: str, params: PaperParams, given: bool) -> Score:
    """Score one interpretation on one run."""
    constellation, (first, last) = log.constellation, log.t_range
    if given:
        pos, _ = log.truth.positions(constellation, np.array([first]))
        layout = tuple((float(x), float(y), float(z)) for x, y, z in pos[0])
        params = replace(params, first_layout=layout)
    t = log.truth.times()
    t = t[(t >= first) & (t <= last)][::5]
    tracker = Tracker(
        constellation, TrackerParams(filter=FilterParams(paper=params)), filter=filter
    )
    truth, known = log.truth.pairs(constellation, t)
    return score(tracker.run(log.block, t).take(0), truth, known, first + 10.0)


def main() -> None:
    """Print one table per case."""
    given = dict(enumerate(sys.argv[1:]))
    first, seeds, seconds = int(given.get(0, 0)), int(given.get(1, 20)), float(given.get(2, 60.0))
    for case in PAPER:
        logs = [case.log(seed, seconds) for seed in range(first, first + seeds)]
        print(f"\n{case.name}, {seeds} seeds from {first} of {seconds:g} s")
        print("| reading | " + " | ".join(FIGURES) + " |")
        for name, (filter, options, layout) in READINGS.items():
            params = PaperParams(**options)  # type: ignore[arg-type]
            scores = [track(log, filter, params, layout) for log in logs]
            medians = [np.median([getattr(s, f) for s in scores]) for f in FIGURES]
            print(f"| {name} | " + " | ".join(f"{m:.3f}" for m in medians) + " |", flush=True)


if __name__ == "__main__":
    main()
