"""How long the protocol takes to recover when nodes come and go.

Measured by an onlooker who hears every message:

- responder-join: from the moment a node has power to the end of the message that makes all
  others know it.
- responder-leave: from the moment it has none to the begin of the first message behind its
  empty slot; from then on it costs no time but that of listening into silence.
- initiator-loss: from the moment it has no power to the end of the first whole round of the
  others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from agents.protocol.group import DT, Group, Heard, radio_params
from tracking.ranging.wire import Type

EVENTS = ("responder-join", "responder-leave", "initiator-loss")
MODES = ("watchdog", "succession")
NODES = 4
_PATIENCE = {"responder-join": 2.0, "responder-leave": 1.0, "initiator-loss": 3.0}


def measure_recovery(
    seed: int, events: int, progress: Callable[[float], None]
) -> tuple[list[dict[str, Any]], dict[tuple[str, str], list[float]]]:
    """Recovery times of a group of four.

    Args:
        seed: Same seed, same figures.
        events: How many of each kind.
        progress: Called with the share done.

    Returns:
        One record for each kind of event and mode; all times of each [s].
    """
    times: dict[tuple[str, str], list[float]] = {}
    for m, mode in enumerate(MODES):
        joins, leaves, losses = [], [], []
        for k in range(events):
            rng = np.random.default_rng([seed, m, k])
            joined, left = _responder_comes_and_goes(mode, rng)
            joins.append(joined)
            leaves.append(left)
            losses.append(_initiator_goes(mode, rng))
            progress((m + (k + 1) / events) / len(MODES))
        times |= {(e, mode): t for e, t in zip(EVENTS, (joins, leaves, losses), strict=True)}
    return [_record(event, mode, found) for (event, mode), found in times.items()], times


def _record(event: str, mode: str, times: Sequence[float]) -> dict[str, Any]:
    ms = 1e3 * np.array(times)
    return {
        "experiment": "recovery",
        "event": event,
        "mode": mode,
        "events": len(ms),
        "nodes": NODES,
        "mean_ms": float(ms.mean()),
        "p95_ms": float(np.percentile(ms, 95.0)),
        "max_ms": float(ms.max()),
    }


def _assembled(nodes: range, mode: str, rng: np.random.Generator) -> Group:
    """A group that has ranged for a moment; its phase is random."""
    group = Group(radio_params(succession=mode == "succession"), NODES, rng)
    for k in nodes:
        group.switch_on(k, float(rng.uniform(0.0, 0.02)))
    group.assemble(nodes, limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    group.listen()
    return group


def _responder_comes_and_goes(mode: str, rng: np.random.Generator) -> tuple[float, float]:
    group = _assembled(range(NODES - 1), mode, rng)
    node = NODES - 1
    on = group.t + (after := float(rng.uniform(0.0, DT)))
    group.switch_on(node, after)
    joined = _wait(group, "responder-join", lambda heard: _known(heard, node))
    group.assemble(range(NODES), limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    before = group.listen()[-1]
    off = group.t + (after := float(rng.uniform(0.0, DT)))
    group.air.switch_off(node, at=after)
    left = _wait(group, "responder-leave", lambda heard: _closed([before, *heard], node, off))
    return joined - on, left - off


def _initiator_goes(mode: str, rng: np.random.Generator) -> float:
    group = _assembled(range(1, NODES), mode, rng)
    group.switch_on(0, float(rng.uniform(0.0, DT)))  # a smaller ID takes over ...
    group.assemble(range(NODES), limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    group.listen()
    off = group.t + (after := float(rng.uniform(0.0, DT)))
    group.air.switch_off(0, at=after)  # ... and drops out
    return _wait(group, "initiator-loss", lambda heard: _whole_round(heard, 0, off)) - off


def _wait(group: Group, event: str, found: Callable[[list[Heard]], float | None]) -> float:
    """Run until something is found in what was heard; the time limit if it never is."""
    heard: list[Heard] = []
    limit = group.t + _PATIENCE[event]
    while group.t < limit:
        group.run(DT)
        heard += group.listen()
        when = found(heard)
        if when is not None and when < group.t:
            return when
    return limit


def _known(heard: list[Heard], node: int) -> float | None:
    """End of the message of a newcomer after which a request names it."""
    spoken = None
    for h in heard:
        if h.frame.src == node and spoken is None:
            spoken = h.end
        if h.frame.type is Type.JOIN and h.frame.src == node:
            spoken = h.end
        if h.frame.type is Type.REQUEST and any(e.id == node for e in h.frame.entries):
            return spoken
    return None


def _closed(heard: list[Heard], node: int, off: float) -> float | None:
    """Begin of the first message that comes behind the empty slot of a node."""
    slot = NODES - 1  # of the largest ID
    at = -1
    for h in heard:
        if h.start < off:
            at = h.frame.slot if h.frame.src != node or h.end < off else -1
        elif h.frame.src != node and h.frame.type is Type.REQUEST:
            if at < slot:
                return h.start
            at = 0
        elif h.frame.src != node:
            at = h.frame.slot
    return None


def _whole_round(heard: list[Heard], node: int, off: float) -> float | None:
    """End of the first round after a loss in which all the others spoke."""
    others = {k for k in range(NODES) if k != node}
    spoken: set[int] = set()
    for h in heard:
        if h.start < off:
            continue
        if h.frame.type is Type.REQUEST:
            spoken = set()
        if h.frame.type in (Type.REQUEST, Type.REPLY) and h.frame.root != node:
            spoken.add(h.frame.src)
            if spoken == others:
                return h.end
    return None
