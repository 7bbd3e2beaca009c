"""Range errors due to clock errors between moving nodes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from agents.protocol.group import DT, radio_params
from relpos_env.sensors.radio.channel import CALIBRATED, EXACT
from relpos_env.sensors.radio.radio import Radio
from tracking.arrays import F64
from tracking.ranging.frames.airtime import PAPER_PHY, message_time
from tracking.ranging.frames.timestamps import SPEED_OF_LIGHT

PPM = (0.0, 5.0, 10.0, 20.0)
SPEED = 2.0
"""[m/s] Range rate between node 0 and the others."""


def measure_clock_error(
    seed: int, n_nodes: int = 6, envs: int = 8, seconds: float = 30.0
) -> list[dict[str, Any]]:
    """Measure the errors of ranges between node 0 and the others over the clock error of `PPM`.

    Node 0 is fast and the others are slow by the same number of ppm, so that they differ by twice
    this number. The channel has only noise of timestamps and carrier readings; the noise is
    compared with that of the same group with perfect clocks.

    Args:
        seed: Seed; the same seed gives the same figures.
        n_nodes: Size of the group.
        envs: Number of averaged groups.
        seconds: Length of each run [s].
    """
    errors = {ppm: _errors(seed, n_nodes, ppm, envs, seconds) for ppm in PPM}
    rows = []
    for ppm in PPM:
        for slot in range(1, n_nodes):
            e, perfect = errors[ppm][slot], errors[0.0][slot]
            reply = slot * message_time(PAPER_PHY, n_nodes)
            rows.append(
                {
                    "experiment": "clock",
                    "n": n_nodes,
                    "slot": slot,
                    "ppm": ppm,
                    "bias_cm": float(100.0 * e.mean()),
                    "std_cm": float(100.0 * e.std()),
                    "std_ratio": float(e.std() / perfect.std()),
                    "uncorrected_cm": 100.0 * 0.5 * SPEED_OF_LIGHT * reply * 2e-6 * ppm,
                    "ranges": len(e),
                }
            )
    return rows


def _errors(seed: int, n: int, ppm: float, envs: int, seconds: float) -> dict[int, F64]:
    """Return the range errors between node 0 and the node of each slot [m]."""
    noisy = replace(EXACT, stamp_std=CALIBRATED.stamp_std, carrier_std=CALIBRATED.carrier_std)
    params = replace(radio_params(), channel=noisy)
    if ppm == 0.0:
        params = replace(params, clock_wander=0.0)
    clocks = np.full(n, -1e-6 * ppm)
    clocks[0] = 1e-6 * ppm
    rng = np.random.default_rng(seed)
    seeds = [int(s) for s in rng.integers(1 << 62, size=envs)]
    radio = Radio(params, n, seeds, DT, clocks)
    for e in range(envs):
        for k in range(n):
            radio.switch_on(e, k, boot=int(rng.integers(256)))
    phase = rng.uniform(0.0, 4.0, (envs, 1))

    def distance(t: F64 | float) -> F64:
        """Return the distance of node 0 to all others, a 3 m to 7 m triangle wave, (env, ...)."""
        return np.asarray(3.0 + SPEED * np.abs((t + phase) % 4.0 - 2.0))

    bearing = 2.0 * np.pi * np.arange(n) / n

    def antennas(t: float) -> F64:
        pos = np.zeros((envs, n, 3))
        pos[:, 1:, 0] = distance(t) * np.cos(bearing[1:])
        pos[:, 1:, 1] = distance(t) * np.sin(bearing[1:])
        return pos

    found: dict[int, list[F64]] = {slot: [] for slot in range(1, n)}
    for w in range(round(seconds / DT)):
        ranges = radio.step(antennas(w * DT), antennas((w + 1) * DT))
        used = np.arange(ranges.t.shape[1]) < ranges.count[:, None]
        error = ranges.values[:, :, 0] - distance(ranges.t)
        for slot in found:
            chosen = used & (ranges.i == 0) & (ranges.j == slot) & (ranges.t > 3.0)
            found[slot].append(error[chosen])
    return {slot: np.concatenate(parts) for slot, parts in found.items()}
