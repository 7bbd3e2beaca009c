"""The small parts that messages of ROS 2 are made of, as dicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Message:
    """A message with its place in the file."""

    t_ns: int
    topic: str
    type: str
    """One of `ros_definitions`."""
    content: dict[str, Any]


def frame(node: int) -> str:
    """Name of a node's body frame, x forward, y left, z up, as REP 103 has it."""
    return f"node_{node}"


def header(t_ns: int, frame_id: str) -> dict[str, Any]:
    """std_msgs/Header."""
    second, part = divmod(t_ns, 1_000_000_000)
    return {"stamp": {"sec": second, "nanosec": part}, "frame_id": frame_id}


def xyz(v: Sequence[float]) -> dict[str, float]:
    """Vector3 or Point."""
    return {"x": float(v[0]), "y": float(v[1]), "z": float(v[2])}


def quaternion(q: Sequence[float]) -> dict[str, float]:
    """Quaternion of w x y z."""
    return {"x": float(q[1]), "y": float(q[2]), "z": float(q[3]), "w": float(q[0])}
