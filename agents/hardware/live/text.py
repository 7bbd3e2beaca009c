"""Snapshots as text: rows of tables, and one-line summaries."""

from __future__ import annotations

from agents.hardware.live.snapshot import Snapshot

NONE = "-"
NODE_HEADER = ("node", "last message", "IMU", "ranges", "battery", "heading")
PAIR_HEADER = ("pair", "forward", "left", "distance", "sigma", "age", "NLOS", "status")


def node_rows(snapshot: Snapshot) -> list[list[str]]:
    """Return one row per node with the columns of `NODE_HEADER`."""
    return [
        [
            str(n.node),
            "never" if n.message_age is None else f"{n.message_age:.2f} s",
            f"{n.imu_hz:.0f} Hz",
            f"{n.range_hz:.0f} Hz",
            _number(n.voltage, "{:.2f} V"),
            _number(None if n.heading is None else n.heading * 57.29577951308232, "{:.0f} deg"),
        ]
        for n in snapshot.nodes
    ]


def pair_header(snapshot: Snapshot) -> list[str]:
    """Return `PAIR_HEADER`, with a column for the height in three dimensions."""
    names = list(PAIR_HEADER)
    if any(pair.up is not None for pair in snapshot.pairs):
        names.insert(3, "up")
    return names


def pair_rows(snapshot: Snapshot) -> list[list[str]]:
    """Return one row per pair with the columns of `pair_header`."""
    high = "up" in pair_header(snapshot)
    return [
        [
            f"{p.node_i}-{p.node_j}",
            _number(p.forward, "{:+.2f} m"),
            _number(p.left, "{:+.2f} m"),
            *([_number(p.up, "{:+.2f} m")] if high else []),
            _number(p.distance, "{:.2f} m"),
            _number(p.std, "{:.2f} m"),
            _number(p.age, "{:.2f} s"),
            _number(None if p.nlos_prob is None else 100.0 * p.nlos_prob, "{:.0f} %"),
            p.status,
        ]
        for p in snapshot.pairs
    ]


def line(snapshot: Snapshot) -> str:
    """Return a one-line summary of a snapshot."""
    pairs = ", ".join(
        f"{p.node_i}-{p.node_j} {p.status}"
        if p.distance is None
        else f"{p.node_i}-{p.node_j} {p.distance:.2f} m +-{p.std:.2f} {p.status}"
        for p in snapshot.pairs
    )
    active = sum(n.message_age is not None and n.message_age < 1.0 for n in snapshot.nodes)
    return f"{snapshot.t:7.1f} s  {active} of {len(snapshot.nodes)} nodes active  {pairs}"


def _number(value: float | None, form: str) -> str:
    return NONE if value is None else form.format(value)
