"""Measure properties of the simulation without parameters, for `relpos_env.core.oracle_params`.

Rates of transitions between LOS and NLOS of pairs of cars, standard deviation of power differences,
and slip of rear axles that the filter does not model. Slip is correlated in time, but the filter
models it as white noise at 20 Hz; it is therefore reported as the white noise with the same
variance of its means over some seconds.

Run `python benchmarks/measure_world.py [SCENARIO] [FIRST SEED] [DRIVES]`; one second per drive.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from agents.simulation.simulate import simulate
from tracking.geometry import yaw_of
from tracking.log.folder import Log
from tracking.measurements import Kind

SECONDS = 120.0
PERIOD = 0.05
"""[s] Period of motion constraints in the filter."""
SPANS = 0.05, 0.5, 2.0, 8.0
"""[s] Averaging times of slip."""


def sight(log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Return LOS statistics of the ranges of all pairs.

    Returns:
        Time in LOS and NLOS [s], transitions to NLOS and to LOS, (4,); power difference [dB] and
        1 for LOS, (range, 2).
    """
    is_range = log.block.kind[0] == Kind.RANGE
    t, i, j, values = (
        x[0, is_range] for x in (log.block.t, log.block.i, log.block.j, log.block.values)
    )
    pair = np.minimum(i, j) * log.constellation.n_nodes + np.maximum(i, j)
    total = np.zeros(4)
    for of in (pair == name for name in np.unique(pair)):
        hidden, dt = log.nlos[of], np.diff(t[of])
        before, after = hidden[:-1], hidden[1:]
        total += [
            dt[~before].sum(),
            dt[before].sum(),
            (~before & after).sum(),
            (before & ~after).sum(),
        ]
    return total, np.stack([values[:, 1] - values[:, 2], ~log.nlos], axis=1)


def slips(log: Log) -> list[np.ndarray]:
    """Return mean lateral speeds after fitting the mount of each car, by `SPANS` [m/s]."""
    out: list[list[np.ndarray]] = [[] for _ in SPANS]
    for node in range(log.constellation.n_nodes):
        row = log.truth.node == node
        t, pos, yaw = log.truth.t[row], log.truth.pos_w[row], np.unwrap(yaw_of(log.truth.q_wb[row]))
        at = np.arange(t[0], t[-1], PERIOD)
        x, y, yaw = (np.interp(at, t, of) for of in (pos[:, 0], pos[:, 1], yaw))
        vx, vy, rate = (np.gradient(of, at) for of in (x, y, yaw))
        forward = np.cos(yaw) * vx + np.sin(yaw) * vy
        left = np.cos(yaw) * vy - np.sin(yaw) * vx
        mount = np.stack([rate, -rate * forward**2], axis=1)
        rest = left - mount @ np.linalg.lstsq(mount, left)[0]
        for means, span in zip(out, SPANS, strict=True):
            n = round(span / PERIOD)
            means.append(rest[: len(rest) // n * n].reshape(-1, n).mean(axis=1))
    return [np.concatenate(means) for means in out]


def main() -> None:
    """Print the measured properties."""
    given = dict(enumerate(sys.argv[1:]))
    name, first = given.get(0, "cars-nlos"), int(given.get(1, 7000))
    total, gaps, rests = np.zeros(4), [], []
    for seed in range(first, first + int(given.get(2, 20))):
        log = simulate(scenario=name, seconds=SECONDS, seed=seed)
        found, gap = sight(log)
        total += found
        gaps.append(gap)
        rests.append(slips(log))
    gap, clear = np.concatenate(gaps).T
    white = [
        float(np.sqrt(np.mean(np.concatenate(of) ** 2) * span / PERIOD))
        for span, of in zip(SPANS, zip(*rests, strict=True), strict=True)
    ]
    print(
        json.dumps(
            {
                "hidden_share": total[1] / total[:2].sum(),
                "enter_rate": total[2] / total[0],
                "leave_rate": total[3] / total[1] if total[1] else None,
                "gap_los_std": float(gap[clear == 1.0].std()),
                "gap_nlos_std": float(gap[clear == 0.0].std()) if total[1] else None,
                "sideways_std": dict(zip(map(str, SPANS), white, strict=True)),
            },
            indent=1,
        )
    )


if __name__ == "__main__":
    main()
