"""Status of a running drive: a table of the cars, and a JSON record."""

from __future__ import annotations

from typing import Any

import numpy as np

from hardware_bridge.live.env import HardwareFormationEnv
from hardware_bridge.live.opened import OpenBridge
from hardware_bridge.safety.gate import reason_text
from tracking.estimate import Status

HEADER = ("car", "state", "asked [m/s]", "passed [m/s]", "error [m]", "sees", "why")
LINES = 4
"""[-] Lines of notices below the table."""


def car_rows(bridge: OpenBridge, env: HardwareFormationEnv) -> list[list[str]]:
    """Return one row per slot with the columns of `HEADER`."""
    report, group = bridge.feed.report, env.group
    view, config = bridge.swarm.view, bridge.config
    driven = {config.slot_of(car) for car in config.cars}
    rows = []
    for k in range(config.n_slots):
        state, passed, why = "listening", "", ""
        if not view.present[0, k]:
            state = "silent"
        if report is not None and k in driven:
            armed = bool(report.armed[k])
            state = "STOP" if report.emergency else "armed" if armed else state
            passed, why = f"{report.speed[k]:.2f}", reason_text(int(report.reason[k]))
        others = [j for j in range(config.n_slots) if j != k]
        sees = " ".join(Status(int(view.status[0, k, j])).name.lower() for j in others)
        rows.append(
            [
                str(bridge.swarm.group.ids[k]),
                state,
                f"{group.asked[k, 0]:.2f}",
                passed,
                f"{group.task.error[0, k]:.2f}",
                sees,
                why,
            ]
        )
    return rows


def status_record(bridge: OpenBridge, env: HardwareFormationEnv) -> dict[str, Any]:
    """Return the state of a drive as a JSON record."""
    report, group = bridge.feed.report, env.group
    present = group.estimated.present[0]
    error = group.task.error[0, present]
    return {
        "result": "second",
        "t": round(bridge.swarm.intake.seconds(group.t_ns), 3),
        "error": float(error.mean()) if present.any() else None,
        "present": int(present.sum()),
        "armed": int(np.sum(report.armed)) if report is not None else 0,
        "emergency": bool(report.emergency) if report is not None else False,
        "lag_ms": round(1e3 * report.lag, 3) if report is not None else None,
        "missed_ticks": report.missed if report is not None else 0,
    }
