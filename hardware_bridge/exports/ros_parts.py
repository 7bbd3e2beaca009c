"""Parts of ROS 2 messages, as dicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Message:
    """A message with its time and topic."""

    t_ns: int
    topic: str
    type: str
    """Type, one of `ros_definitions`."""
    content: dict[str, Any]


def frame(node: int) -> str:
    """Return the name of a node's body frame, x forward, y left, z up, as in REP 103."""
    return f"node_{node}"


def header(t_ns: int, frame_id: str) -> dict[str, Any]:
    """Return a std_msgs/Header."""
    second, part = divmod(t_ns, 1_000_000_000)
    return {"stamp": {"sec": second, "nanosec": part}, "frame_id": frame_id}


def xyz(v: Sequence[float]) -> dict[str, float]:
    """Return a Vector3 or Point."""
    return {"x": float(v[0]), "y": float(v[1]), "z": float(v[2])}


def quaternion(q: Sequence[float]) -> dict[str, float]:
    """Return a Quaternion from w x y z."""
    return {"x": float(q[1]), "y": float(q[2]), "z": float(q[3]), "w": float(q[0])}
