"""Recovery times of the protocol when nodes join and leave.

Measured by an ideal observer that receives every message:

- responder-join: from power-on of a node to the end of its join message; `named` is the end of the
  request that lists the node and assigns its slot.
- responder-leave: from power-off of a node to the start of the first message after its empty slot;
  from then on, the empty slot costs only its listening time.
- initiator-loss: from power-off of the initiator to the end of the first complete round of the
  others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from agents.errors import UsageError
from agents.protocol.group import DT, Group, ReceivedMessage, radio_params
from tracking.ranging.frames.wire import Type

EVENTS = ("responder-join", "responder-leave", "initiator-loss")
MODES = ("watchdog", "succession")
NODES = 4
LIMIT = 10.0
"""[s] Upper limit of a recovery; exceeding it is an error."""


def measure_recovery(
    seed: int, events: int, progress: Callable[[float], None]
) -> tuple[list[dict[str, Any]], dict[tuple[str, str], list[float]]]:
    """Measure recovery times of a group of four nodes.

    Args:
        seed: Seed; the same seed gives the same figures.
        events: Number of events of each kind and mode.
        progress: Called with the share done, 0 to 1.

    Returns:
        One record for each kind of event and mode; all times of each [s].
    """
    times: dict[tuple[str, str], list[float]] = {}
    named_ms: dict[str, float] = {}
    for m, mode in enumerate(MODES):
        joins, slots, leaves, losses = [], [], [], []
        for k in range(events):
            rng = np.random.default_rng([seed, m, k])
            joined, named, left = _responder_comes_and_goes(mode, rng)
            joins.append(joined)
            slots.append(named)
            leaves.append(left)
            losses.append(_initiator_goes(mode, rng))
            progress((m + (k + 1) / events) / len(MODES))
        times |= {(e, mode): t for e, t in zip(EVENTS, (joins, leaves, losses), strict=True)}
        named_ms[mode] = 1e3 * float(np.mean(slots))
    records = [_record(event, mode, found) for (event, mode), found in times.items()]
    for record in records:
        if record["event"] == "responder-join":
            record["named_mean_ms"] = named_ms[record["mode"]]
    return records, times


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
    """Return an assembled group with a random phase of its rounds."""
    group = Group(radio_params(succession=mode == "succession"), NODES, rng)
    for k in nodes:
        group.switch_on(k, float(rng.uniform(0.0, 0.02)))
    group.assemble(nodes, limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    group.listen()
    return group


def _responder_comes_and_goes(mode: str, rng: np.random.Generator) -> tuple[float, float, float]:
    """Return the times of the join, of the request that lists the node, and of the leave [s]."""
    group = _assembled(range(NODES - 1), mode, rng)
    node = NODES - 1
    on = group.t + (after := float(rng.uniform(0.0, DT)))
    group.switch_on(node, after)
    joined, named = _wait(group, "responder-join", lambda received: _known(received, node))
    group.assemble(range(NODES), limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    before = group.listen()[-1]
    off = group.t + (after := float(rng.uniform(0.0, DT)))
    group.air.switch_off(node, at=after)
    (left,) = _wait(
        group, "responder-leave", lambda received: _closed([before, *received], node, off)
    )
    return joined - on, named - on, left - off


def _initiator_goes(mode: str, rng: np.random.Generator) -> float:
    group = _assembled(range(1, NODES), mode, rng)
    group.switch_on(0, float(rng.uniform(0.0, DT)))  # a smaller ID takes over ...
    group.assemble(range(NODES), limit=20.0)
    group.run(float(rng.uniform(0.1, 0.2)))
    group.listen()
    off = group.t + (after := float(rng.uniform(0.0, DT)))
    group.air.switch_off(0, at=after)  # ... and drops out
    (recovered,) = _wait(group, "initiator-loss", lambda received: _whole_round(received, 0, off))
    return recovered - off


def _wait(
    group: Group, event: str, found: Callable[[list[ReceivedMessage]], tuple[float, ...] | None]
) -> tuple[float, ...]:
    """Run until `found` returns times in the received messages; return these times [s]."""
    received: list[ReceivedMessage] = []
    limit = group.t + LIMIT
    while group.t < limit:
        group.run(DT)
        received += group.listen()
        when = found(received)
        if when is not None and max(when) < group.t:
            return when
    raise UsageError(f"protocol: {event} did not end within {LIMIT:g} s")


def _known(received: list[ReceivedMessage], node: int) -> tuple[float, float] | None:
    """Return the end of a node's join, and of the next request that lists the node [s]."""
    joined = None
    for h in received:
        if h.frame.src == node and joined is None:
            joined = h.end
        if h.frame.type is Type.JOIN and h.frame.src == node:
            joined = h.end
        if h.frame.type is Type.REQUEST and any(e.id == node for e in h.frame.entries):
            return None if joined is None else (joined, h.end)
    return None


def _closed(received: list[ReceivedMessage], node: int, off: float) -> tuple[float] | None:
    """Return the start of the first message after the empty slot of a node [s]."""
    slot = NODES - 1  # slot of the largest ID
    at = -1
    for h in received:
        if h.start < off:
            at = h.frame.slot if h.frame.src != node or h.end < off else -1
        elif h.frame.src != node and h.frame.type is Type.REQUEST:
            if at < slot:
                return (h.start,)
            at = 0
        elif h.frame.src != node:
            at = h.frame.slot
    return None


def _whole_round(received: list[ReceivedMessage], node: int, off: float) -> tuple[float] | None:
    """Return the end of the first round after a loss with messages of all other nodes [s]."""
    others = {k for k in range(NODES) if k != node}
    sources: set[int] = set()
    for h in received:
        if h.start < off:
            continue
        if h.frame.type is Type.REQUEST:
            sources = set()
        if h.frame.type in (Type.REQUEST, Type.REPLY) and h.frame.root != node:
            sources.add(h.frame.src)
            if sources == others:
                return (h.end,)
    return None
