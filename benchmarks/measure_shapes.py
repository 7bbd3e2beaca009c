"""Which formation tells a group most about itself: expected errors of shapes, and drives in them.

The expected error of a relative position is the Cramer-Rao bound of ranges between all pairs and a
common error of the heading, for slots at least 1 m apart. The optimum is that of the mean square
over the pairs (A-optimal), the best of `STARTS` descents.

Run `python benchmarks/measure_shapes.py`; writes `benchmarks/results/shapes.jsonl`, two minutes.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from agents.comparison.contender import find_entry
from agents.comparison.meter import Meter
from agents.comparison.simulated import Simulated
from relpos_env.config import configure
from relpos_env.tasks.geometry.shapes import SHAPES
from tracking.arrays import F64

OUT = Path(__file__).parent / "results" / "shapes.jsonl"
RANGE_STD, HEADING_STD = 0.05, 0.03
"""[m] of a range, [rad] of the heading of the group."""
DETERMINED = 1e10
"""[-] Condition number up to which ranges determine the shape; those of cars in a line do not."""
NUMBERS, STARTS = (3, 4, 5, 6, 8), 12
CARS, EPISODES, FIRST_SEED, CYCLES, SETTLE = 6, 100, 1000, 600, 100


def expected_error(slots: F64) -> float:
    """Return the root mean square error of the relative positions of slots, (slot, 2) [m]."""
    n = len(slots)
    pairs = np.array([(i, j) for i in range(n) for j in range(i)])
    difference = np.zeros((len(pairs), n))
    difference[np.arange(len(pairs)), pairs[:, 0]] = 1.0
    difference[np.arange(len(pairs)), pairs[:, 1]] = -1.0
    apart = difference @ slots
    direction = apart / np.linalg.norm(apart, axis=1, keepdims=True)
    rows = (difference[:, :, None] * direction[:, None, :]).reshape(len(pairs), -1) / RANGE_STD
    own = slots - slots.mean(axis=0)
    turn = np.stack([-own[:, 1], own[:, 0]], axis=1).ravel()
    turn /= HEADING_STD * (own**2).sum()
    # Shifts of the whole do not change relative positions: any finite certainty of them will do.
    shifts = np.tile(np.eye(2), n)
    information = rows.T @ rows + np.outer(turn, turn) + shifts.T @ shifts
    if np.linalg.cond(information) > DETERMINED:
        return np.inf
    cov = np.linalg.inv(information)
    both = np.kron(difference, np.eye(2))
    return float(np.sqrt(np.trace(both @ cov @ both.T) / len(pairs)))


def best_error(n: int) -> float:
    """Return the least expected error of n slots at least 1 m apart [m]."""
    rng, found = np.random.default_rng(0), []
    upper = np.triu_indices(n, 1)

    def gaps(x: F64) -> F64:
        slots = x.reshape(n, 2)
        return np.linalg.norm(slots[:, None] - slots[None], axis=-1)[upper] - 1.0

    for _ in range(STARTS):
        start = rng.normal(size=2 * n) * np.sqrt(n)
        done = minimize(
            lambda x: np.log(expected_error(x.reshape(n, 2))),
            start, method="SLSQP", constraints={"type": "ineq", "fun": gaps},
        )  # fmt: skip
        if done.success:
            found.append(float(np.exp(done.fun)))
    return min(found)


def driven(shape: str, controller: str) -> dict[str, float]:
    """Return the means of drives of the task `observe` in `open`."""
    parts = configure(
        {
            "task": "observe", "scenario": "open", "observation": "estimate_cov", "n_cars": CARS,
            "task_options": {"shape": shape}, "max_cycles": CYCLES,
        }
    )  # fmt: skip
    seeds = range(FIRST_SEED, FIRST_SEED + EPISODES)
    running = Simulated(parts, seeds)
    driver, meter = find_entry(controller).driver("estimate_cov", CARS, 0), Meter(running)
    while meter.going.any():
        running.step(np.stack([driver.act(seen) for seen in running.observations]))
        meter.read()
    results = [meter.result(e, s, SETTLE) for e, s in enumerate(seeds)]
    names = "tracking_error", "formation_error", "collisions_per_min"
    return {name: float(np.nanmean([getattr(r, name) for r in results])) for name in names}


def main() -> None:
    """Write the expected errors and the drives."""
    lines = []
    for n in NUMBERS:
        errors = {"best": best_error(n)}
        errors |= {name: expected_error(make(n)) for name, make in SHAPES.items()}
        rounded = {k: float(f"{v:.3g}") if np.isfinite(v) else None for k, v in errors.items()}
        lines.append({"cars": n, **rounded})
        print(json.dumps(lines[-1]), flush=True)
    for controller in ("consensus", "weaving"):
        for shape in SHAPES:
            found = {k: float(f"{v:.3g}") for k, v in driven(shape, controller).items()}
            lines.append({"shape": shape, "driver": controller, **found})
            print(json.dumps(lines[-1]), flush=True)
    OUT.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")


if __name__ == "__main__":
    main()
