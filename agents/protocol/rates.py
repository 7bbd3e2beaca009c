"""Rate of ranging rounds over the number of nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from agents.protocol.group import Group, radio_params
from relpos_env.sensors.radio.channel import EXACT
from tracking.ranging.exchange import RangeEvent
from tracking.ranging.frames.airtime import PHYS, round_rate
from tracking.ranging.frames.wire import Type

PAPER_HZ = {("110k", 3): 81.83, ("110k", 6): 28.6}
"""[Hz] Rate of rounds by radio mode and number of nodes (Armani and Holz, ICRA 2024)."""
NODES = (3, 4, 5, 6, 10, 20, 50)


def measure_rates(
    seed: int, nodes: tuple[int, ...], progress: Callable[[float], None]
) -> list[dict[str, Any]]:
    """Measure rounds per second of assembled groups on a channel without losses.

    Args:
        seed: Seed; the same seed gives the same figures.
        nodes: Sizes of the groups.
        progress: Called with the share done, 0 to 1.
    """
    cases = [(phy, n) for phy in PHYS for n in nodes]
    weights = np.cumsum([n**3 for _, n in cases])
    rows = []
    for k, (phy, n) in enumerate(cases):
        rows.append(_measure(phy, n, np.random.default_rng([seed, n])))
        progress(float(weights[k] / weights[-1]))
    return rows


def _measure(phy: str, n: int, rng: np.random.Generator) -> dict[str, Any]:
    group = Group(replace(radio_params(phy=PHYS[phy]), channel=EXACT), n, rng)
    for k in range(n):
        group.switch_on(k, float(rng.uniform(0.0, 0.05)))
    group.assemble(range(n), limit=120.0)
    assembled, model_hz = group.t, round_rate(PHYS[phy], n)
    group.run(max(5.0 / model_hz, 1.5))  # until clocks are estimated, tables full, IDs checked
    group.listen()
    group.air.events.clear()
    group.run(max(6.0 / model_hz, min(2.0, 100.0 / model_hz)))
    requests = [h.start for h in group.listen() if h.frame.type is Type.REQUEST]
    requests = [t for k, t in enumerate(requests) if k == 0 or t - requests[k - 1] > 0.5 / model_hz]
    hz = (len(requests) - 1) / (requests[-1] - requests[0])
    between = [
        output
        for output in group.air.events
        if isinstance(output.event, RangeEvent) and requests[0] <= output.t < requests[-1]
    ]
    pairs = n * (n - 1) / 2 * (len(requests) - 1)
    return {
        "experiment": "rate",
        "phy": phy,
        "n": n,
        "rounds_hz": hz,
        "paper_hz": PAPER_HZ.get((phy, n)),
        "model_hz": model_hz,
        "complete": len(between) / pairs / n,
        "assembled_s": assembled,
    }
