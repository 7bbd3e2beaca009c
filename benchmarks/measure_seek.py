"""How well a transponder that only ranges is found, for `docs/reference/tasks.md`.

Run `python benchmarks/measure_seek.py`; consensus drives 20 episodes of 60 s, seeds 0 to 19.
"""

from __future__ import annotations

import numpy as np

from agents.comparison.contender import find_entry
from agents.comparison.simulated import Simulated
from relpos_env.config import configure

RUNS = (("hall", 5, "seek"), ("hall", 4, "seek"), ("open", 6, "seek"), ("hall", 5, "escort"))
EPISODES, CYCLES, SETTLE = 20, 600, 100
WRONG = 0.5
"""[m] Error from which a position is wrong."""


def measure(scenario: str, n_cars: int, task: str) -> dict[str, float]:
    """Return shares of the time and the error [m] of the positions of car 0 by the others."""
    parts = configure({"task": task, "scenario": scenario, "n_cars": n_cars, "max_cycles": CYCLES})
    running = Simulated(parts, range(EPISODES))
    driver = find_entry("consensus").driver("estimate", n_cars, 0)
    errors = []
    for _ in range(CYCLES):
        running.step(np.stack([driver.act(seen) for seen in running.observations]))
        view, pos = running.formation.loop.view, running.formation.state.pos_w
        off = np.linalg.norm(view.pos[:, 1:, 0] - (pos[:, :1] - pos[:, 1:]), axis=-1)
        errors.append(np.where(view.ok[:, 1:, 0], off, np.nan))
    found = np.array(errors)
    usable = np.isfinite(found)
    return {
        "usable": float(usable.mean()),
        "wrong": float((found[usable] > WRONG).mean()),
        "error": float(np.sqrt(np.nanmean(found[SETTLE:] ** 2))),
    }


if __name__ == "__main__":
    for scenario, n_cars, task in RUNS:
        figures = {k: round(v, 4) for k, v in measure(scenario, n_cars, task).items()}
        print(task, scenario, n_cars, figures, flush=True)
