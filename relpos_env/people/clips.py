"""Motion capture of people, read from a folder of `.npz` files.

A file holds evenly spaced times `t`, `position` and `quaternion` of six trackers at joint
centres, and `body_start`, `body_end`, `body_radius` of the limbs called `body_names`. The
trackers are put on the skin, and forearms are added, which the files lack. Segment frames are
those of the recordings: y up and z forward of a person with arms stretched out sideways.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from relpos_env.errors import EnvError
from relpos_env.people.motion import HIDING
from tracking.arrays import F64, Bool
from tracking.geometry import quat_from_yaw, quat_multiply, rotate
from tracking.params.short_repr import short_repr

FOREARM = 0.04
"""[m] Radius of a forearm."""
WAIST = 0.05
"""[m] Height of the lower end of the trunk's axis over the hip joints, so that the end fills the
pelvis; in the files it is at the waist."""
ON_SKIN = np.array(
    [
        [0.0, 0.065, 0.0],
        [0.0, 0.055, 0.0],
        [-0.095, 0.060, 0.0],
        [0.0, 0.055, 0.0],
        [-0.053, 0.083, 0.054],
        [0.053, 0.083, 0.054],
    ]
)
"""[m] Offsets of trackers from the joint centres of the files, in segment frames: outside of the
arms, on the belt, and on the thighs 6 cm over the knees, half outside and half in front."""
ARRAYS = {
    "t", "position", "quaternion", "body_names", "body_start", "body_end", "body_radius"
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Clip:
    """One recording, centred on the middle of the floor."""

    __repr__ = short_repr

    dt: float
    """Time between samples [s]."""
    points: F64
    """Trackers, then starts and then ends of all limbs, (time, point, 3) [m]."""
    q_wb: F64
    """Orientation of the trackers, (time, site, 4)."""
    radius: F64
    """Radius of the limbs, (limb) [m]."""
    hides: Bool
    """True for limbs that occlude the radio, (limb)."""
    hips: tuple[int, int]
    """Indices of the left and right hip joint among the points."""

    def turned(self, yaw: float) -> Clip:
        """Return the clip rotated by `yaw` about the vertical through the middle [rad]."""
        q = quat_from_yaw(yaw)
        return replace(
            self,
            points=rotate(q, self.points),
            q_wb=quat_multiply(np.broadcast_to(q, self.q_wb.shape), self.q_wb),
        )

    def place(self) -> tuple[F64, F64]:
        """Return the middle of the hips, (time, 2) [m], and the facing direction, (time) [rad]."""
        left, right = (self.points[:, k, :2] for k in self.hips)
        across = left - right
        return 0.5 * (left + right), np.arctan2(-across[:, 0], across[:, 1])


def find_recordings() -> Path | None:
    """Return the motion capture folder in RELPOS_DATA or ../shared/data next to the project."""
    named = os.environ.get("RELPOS_DATA")
    data = Path(named) if named else Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = data / "human_motion"
    return folder if any(folder.glob("*.npz")) else None


def load_clips(folder: Path | None = None) -> list[Clip]:
    """Read all clips of a folder.

    Args:
        folder: Folder with `.npz` files; that of `find_recordings` if None.

    Raises:
        EnvError: There is no such folder, or a file has unexpected contents.
    """
    folder = folder or find_recordings()
    files = sorted(folder.glob("*.npz")) if folder is not None else []
    if not files:
        raise EnvError(
            "motion: found no motion capture; set RELPOS_DATA to a folder with "
            "human_motion/*.npz, or take scenario 'human', which needs none"
        )
    clips = [_load(path) for path in files]
    if len({(round(1.0 / clip.dt, 3), clip.points.shape[1]) for clip in clips}) > 1:
        raise EnvError(f"{files[0].parent}: expected clips of one rate with the same limbs")
    return clips


def _load(path: Path) -> Clip:
    with np.load(path) as file:
        missing = ARRAYS - set(file)
        if missing:
            raise EnvError(f"{path.name}: expected arrays {', '.join(sorted(missing))}")
        data = {name: file[name] for name in ARRAYS}
    names = [str(name).replace("torso", "trunk") for name in data["body_names"]]
    pos, q = data["position"].astype(np.float64), data["quaternion"].astype(np.float64)
    start, end = data["body_start"].astype(np.float64), data["body_end"].astype(np.float64)
    if pos.shape[1:] != (6, 3) or not np.isfinite(pos).all():
        raise EnvError(f"{path.name}: expected finite positions of 6 trackers, got {pos.shape}")
    trunk = names.index("trunk")
    hips = start[:, [names.index("left_thigh"), names.index("right_thigh")]].mean(axis=1)
    up = end[:, trunk] - hips
    start[:, trunk] = hips + WAIST * up / np.linalg.norm(up, axis=1, keepdims=True)
    elbows = end[:, [names.index("right_upper_arm"), names.index("left_upper_arm")]]
    points = np.concatenate([pos + rotate(q, ON_SKIN), start, elbows, end, pos[:, [1, 3]]], axis=1)
    points[..., :2] -= hips[:, :2].mean(axis=0)
    return Clip(
        float(data["t"][1] - data["t"][0]),
        points,
        q / np.linalg.norm(q, axis=-1, keepdims=True),
        np.concatenate([data["body_radius"].astype(np.float64), [FOREARM, FOREARM]]),
        np.isin([*names, "forearm", "forearm"], HIDING),
        (6 + names.index("left_thigh"), 6 + names.index("right_thigh")),
    )
