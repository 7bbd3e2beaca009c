"""The clock of the IMUs against that of the ranges: motion that is felt and motion that is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding, names
from tracking.findings.trials import inertial, lowest, misfit, moved_in_time, parts_of
from tracking.log.folder import Log
from tracking.measurements import Kind

NEAR = np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
"""[s] Tried of all together."""
ALL = np.concatenate([-np.arange(0.4, 4.1, 0.4)[::-1], NEAR, np.arange(0.4, 4.1, 0.4)])
"""[s] Tried where the fit is best at the ends of that, and where clocks are suspected."""
LEAST_GAIN = 0.04
"""[-] By so much ranges have to fit better."""
TOLD = 0.04
"""[s] Smaller offsets are not told apart from none."""
CARRIED = 0.5
"""[s] Larger ones are refused."""
OFTEN_OK, SELDOM_OK = 0.3, 0.6
"""[-] Shares of time with pairs ok: with a right clock at least; with suspected ones at most."""


def correct_clocks(log: Log, progress: Callable[[float], None]) -> tuple[Log, list[Finding]]:
    """Find by how much IMUs are stamped late, and move them back.

    That of a single node is looked for where pairs are seldom ok: among others that are right, a
    tenth of a second of one is lost in the noise.

    Args:
        log: A recording.
        progress: Called with the share done, 0 to 1.

    Returns:
        The log with what could be corrected, and what was found.
    """
    carriers = np.unique(log.block.i[0, log.block.kind[0] == Kind.IMU])
    if len(carriers) == 0 or log.constellation.n_nodes < 3:
        return log, []
    is_suspected = misfit(log, parts_of(log)[0])[1] < SELDOM_OK
    groups, found = [tuple(carriers.tolist())], list[Finding]()
    if is_suspected and len(carriers) > 1:
        groups += [(n,) for n in carriers.tolist()]
    for k, nodes in enumerate(groups):
        progress(k / len(groups))
        offset, is_carried = _offset(log, nodes, ALL if is_suspected else NEAR)
        ids = tuple(log.constellation.ids[n] for n in nodes)
        way = "later" if offset > 0.0 else "earlier"
        text = f"{names(ids)}: the motion of IMU samples comes {abs(offset):.2f} s {way} than "
        if not is_carried:
            found.append(Finding("clock-offset", ids, f"{text}that of ranges, expected one clock"))
            break
        if abs(offset) > TOLD:
            own = inertial(log.block) & np.isin(log.block.i[0], nodes)
            # Ranges keep their order, so that labels still belong to them.
            log = replace(log, block=moved_in_time(log.block, -offset, own))
            found.append(Finding("clock-corrected", ids, f"{text}that of ranges, corrected"))
    return log, found


def _offset(log: Log, nodes: tuple[int, ...], trials: F64) -> tuple[float, bool]:
    """How late samples of some nodes are stamped [s]; and whether that can be corrected."""
    parts = parts_of(log)

    def cost(part: int, late: float) -> tuple[float, float]:
        block = parts[part]
        own = inertial(block) & np.isin(block.i[0], nodes)
        return misfit(log, moved_in_time(block, -late, own))

    found = lowest(cost, trials, LEAST_GAIN, OFTEN_OK)
    if found is not None and not found[1] and len(trials) < len(ALL):
        found = lowest(cost, ALL, LEAST_GAIN, OFTEN_OK)
    if found is None:
        return 0.0, True
    return found[0], found[1] and abs(found[0]) <= CARRIED
