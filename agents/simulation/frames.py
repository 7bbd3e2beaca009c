"""Frames of an animation of a drive as numbers, rounded to a millimetre."""

from __future__ import annotations

from typing import Any

import numpy as np

from relpos_env.core.env_core import EnvCore
from relpos_env.timing import DECISION
from tracking.arrays import F64

NAMES = (
    "t", "pos", "heading", "present", "boxes", "sight", "viewer", "target", "estimate",
    "tracking", "formation",
)  # fmt: skip
"""Entries of every frame, stored as lists over frames."""


class FrameRecorder:
    """Recorder of the frames of one environment, with the estimates of its first present car."""

    def __init__(self, formation: EnvCore) -> None:
        self._formation = formation
        scenario = formation.parts.scenario
        self.frames: dict[str, Any] = {
            "room": list(scenario.room),
            "car": [scenario.car.length, scenario.car.width],
            "dt": DECISION,
            **{name: [] for name in NAMES},
        }
        self._boxes: list[Any] | None = None

    def add(self) -> None:
        """Append a frame of the current state."""
        formation, swarm = self._formation, self._formation.loop.swarm
        state, task, view = swarm.state.take(0), formation.task, formation.loop.view
        i, j = swarm.constellation.pairs.T
        viewer = int(np.argmax(state.present))
        target, has_target = task.target[0, viewer], task.has_target[0, viewer]
        tracking, formed = errors(formation)
        frame = {
            "t": round(float(formation.t[0]), 2),
            "pos": rounded(state.pos_w),
            "heading": rounded(state.heading),
            "present": state.present.astype(int).tolist(),
            "boxes": [rounded(c) for c in corners(swarm.boxes[0])],
            "sight": swarm.line_of_sight(0)[i, j].astype(int).tolist(),
            "viewer": viewer,
            "target": [
                rounded(place) if has else None
                for place, has in zip(target, has_target, strict=True)
            ],
            "estimate": [
                rounded([*pos, *ellipse(*cov), heading]) if ok else None
                for pos, cov, heading, ok in zip(
                    view.pos[0, viewer],
                    view.cov[0, viewer],
                    view.heading[0],
                    view.ok[0, viewer] & state.present,
                    strict=True,
                )
            ],
            "tracking": None if np.isnan(tracking) else round(tracking, 3),
            "formation": round(formed, 3),
        }
        for name in NAMES:
            self.frames[name].append(frame[name])
        if self._boxes == frame["boxes"]:
            self.frames["boxes"][-1] = None  # unchanged
        self._boxes = frame["boxes"]


def errors(formation: EnvCore) -> tuple[float, float]:
    """Return the current tracking and formation error [m].

    Means over cars with known errors (NaN without any), and over present cars (0 without any).
    """
    tracking, present = formation.tracking_error()[0], formation.state.present[0]
    known = np.isfinite(tracking)
    return (
        float(tracking[known].mean()) if known.any() else np.nan,
        float(formation.task.error[0, present].mean()) if present.any() else 0.0,
    )


def corners(boxes: F64) -> F64:
    """Return the corners of the used boxes in order, (box, 4, 2) [m].

    Args:
        boxes: Centre, half width and half depth [m], cosine, sine, (row, 6); zero size if unused.
    """
    x, y, half_width, half_depth, c, s = boxes[boxes[:, 2] > 0.0].T[:, :, None]
    ahead, left = half_width * [-1.0, 1.0, 1.0, -1.0], half_depth * [-1.0, -1.0, 1.0, 1.0]
    found: F64 = np.stack([x + c * ahead - s * left, y + s * ahead + c * left], axis=-1)
    return found


def ellipse(xx: float, yy: float, xy: float) -> tuple[float, float, float]:
    """Return the principal standard deviations, largest first, and the angle of the first [rad]."""
    values, vectors = np.linalg.eigh([[xx, xy], [xy, yy]])
    a, b = np.sqrt(np.maximum(values[::-1], 0.0))
    return float(a), float(b), float(np.arctan2(vectors[1, 1], vectors[0, 1]))


def rounded(numbers: Any) -> Any:
    """Return nested lists of numbers, rounded to three decimals."""
    return np.round(numbers, 3).tolist()
