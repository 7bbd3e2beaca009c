"""Clock of the IMUs against that of the ranges: motion in IMU samples and in ranges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tracking.arrays import F64
from tracking.findings.finding import Finding, names
from tracking.findings.trials import (
    LONGEST,
    Explained,
    Progress,
    beginning,
    best,
    misfit,
    most_surprise,
    moved_in_time,
    of_nodes,
    through,
)
from tracking.log.folder import Log
from tracking.measurements import Kind

NEAR = np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
"""[s] Trial offsets of each node."""
ALL = np.concatenate([-np.arange(0.4, 4.1, 0.4)[::-1], NEAR, np.arange(0.4, 4.1, 0.4)])
"""[s] Trial offsets of all nodes together, and of each node if ranges are likeliest at the ends of
`NEAR` or an IMU is suspected."""
LEAST_GAIN = 0.01
"""[-] Least gain in log-likelihood of a range; a right clock seems to gain up to 0.007."""
NEGLIGIBLE = 0.04
"""[s] Largest offset that counts as none."""
CARRIED = 0.5
"""[s] Largest offset that is corrected; larger ones are errors."""
DRIFT = 0.15
"""[s] Difference between the offsets of both halves above which clock rates differ; a single node
without suspicion is then not corrected."""
MOST_NODES = 8
"""[-] Largest group whose nodes are all tried; of larger ones, suspects and all together."""


def correct_clocks(
    log: Log, suspects: dict[int, F64], progress: Progress
) -> tuple[Log, list[Finding]]:
    """Estimate clock offsets of IMUs, and correct their stamps.

    The offset with the largest gain is corrected first: of all IMUs together, or of one node.

    Args:
        log: A recording.
        suspects: Nodes whose IMU contradicts the ranges (`imu_against_ranges.find_suspects`). A
            clock offset must make ranges likelier than they are without all of these IMUs.
        progress: Called with the completed share, 0 to 1.

    Returns:
        The log with the corrections, and the findings.
    """
    with_imu = carriers(log)
    if not with_imu or log.constellation.n_nodes < 3:
        return log, []
    alone = with_imu if len(with_imu) <= MOST_NODES else list(suspects)
    groups = [tuple(with_imu)] + [(n,) for n in alone if len(with_imu) > 1]
    found = list[Finding]()
    while groups:
        tried = list[Explained | None]()
        for nodes in through(groups, len(found), progress):
            found_here = _offset(log, nodes, suspects)
            is_alone = len(nodes) == 1 and nodes[0] not in suspects and len(with_imu) > 1
            if found_here is not None and is_alone and _drifts(found_here):
                found_here = None
            tried.append(found_here)
        gains = [0.0 if one is None else one.gain for one in tried]
        nodes, offset = groups[int(np.argmax(gains))], tried[int(np.argmax(gains))]
        if offset is None:
            break
        found.append(_finding(log, nodes, offset))
        if found[-1].severity == "error":
            break
        # Ranges keep their order, so their labels still match.
        own = of_nodes(log.block, nodes)
        log = replace(log, block=moved_in_time(log.block, -offset.at, own))
        # The offset of all nodes is tried once, then the other nodes one by one.
        groups = [one for one in groups if len(one) == 1 and one != nodes]
    return log, found


def carriers(log: Log) -> list[int]:
    """Return the nodes with an IMU."""
    return [int(n) for n in np.unique(log.block.i[0, log.block.kind[0] == Kind.IMU])]


def _offset(log: Log, nodes: tuple[int, ...], suspects: dict[int, F64]) -> Explained | None:
    """Estimate the delay of the stamps of some nodes [s]; `suspects` as in `correct_clocks`."""
    block = beginning(log)
    own, than = of_nodes(block, nodes), list(suspects.values())[-1] if suspects else None

    def cost(late: float) -> F64:
        return misfit(log, moved_in_time(block, -late, own)).surprise

    most = most_surprise(log)
    # Far from the right clock likelihoods have no slope towards it, but local optima.
    is_far = bool(suspects) or len(nodes) == len(carriers(log))
    found = best(cost, ALL if is_far else NEAR, LEAST_GAIN, most, than)
    if found is not None and not found.is_within and not is_far:
        found = best(cost, ALL, LEAST_GAIN, most, than)
    if found is None or abs(found.at) <= NEGLIGIBLE:
        return None
    if found.is_within and abs(found.at) > NEAR[-1]:
        coarse = found.at
        finer = best(lambda late: cost(coarse + late), NEAR, 0.0, most)
        if finer is not None:
            found = found._replace(at=coarse + finer.at)
        if finer is not None and len(nodes) > 1:
            early, late = finer.halves
            found = found._replace(halves=(coarse + early, coarse + late))
    return found


def _drifts(offset: Explained) -> bool:
    early, late = offset.halves
    return abs(late - early) > DRIFT


def _finding(log: Log, nodes: tuple[int, ...], offset: Explained) -> Finding:
    ids = tuple(log.constellation.ids[n] for n in nodes)
    if _drifts(offset):
        early, late = offset.halves
        seconds = 0.5 * min(LONGEST, log.t_range[1] - log.t_range[0])
        text = (
            f"{names(ids)}: the motion of IMU samples comes {early:+.2f} s later than that of "
            f"ranges at first, {late:+.2f} s after {seconds:.0f} s, expected clocks of one rate"
        )
        return Finding("clock-rate", ids, text)
    way = "later" if offset.at > 0.0 else "earlier"
    text = f"{names(ids)}: the motion of IMU samples comes {abs(offset.at):.2f} s {way} than "
    if not offset.is_within or abs(offset.at) > CARRIED:
        return Finding("clock-offset", ids, f"{text}that of ranges, expected one clock")
    return Finding("clock-corrected", ids, f"{text}that of ranges, corrected")
