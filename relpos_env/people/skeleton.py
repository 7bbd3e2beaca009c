"""Forward kinematics: positions of limbs and trackers from the pose of a person.

Frames of all segments are x forward, y left, z up of an upright person with hanging arms.
The legs are solved from hip and ankle in the plane of the foot's direction; every other joint
rotates by the angles of the pose. Trackers are on the skin, outside their own limb.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from relpos_env.people.motion import HIDING, BodySamples, one_sided
from relpos_env.people.pose import SIDES, Pose
from relpos_env.people.skeleton_size import SkeletonSize
from tracking.arrays import F64

SKIN = 0.015
"""[m] Distance from the skin to the middle of a tracker."""
WAIST = 0.05
"""[m] Height of the lower end of the trunk's axis over the hip joints."""
LIMBS = (
    "trunk", "head", "right thigh", "left thigh", "right shank", "left shank",
    "right upper arm", "left upper arm", "right forearm", "left forearm",
)  # fmt: skip
"""Limbs as capsules, in order."""
WORN_ON = ("right upper arm", "right forearm", "trunk", "left forearm", "right thigh", "left thigh")
"""The limb under each tracker."""
RIGHT, LEFT = 0, 1


def body_samples(size: SkeletonSize, pose: Pose, t: F64) -> BodySamples:
    """Return limbs and trackers of a person.

    Args:
        size: Size of the person.
        pose: Pose over time.
        t: Times of the pose, (time) [s].
    """
    pelvis = Rotation.from_euler(
        "ZY", np.column_stack([pose.heading + pose.pelvis_turn, pose.pelvis_tilt])
    )
    trunk = pelvis * Rotation.from_euler("ZY", np.column_stack([pose.twist, pose.trunk_tilt]))
    neck = pose.pelvis_w + trunk.apply([0.0, 0.0, size.trunk])
    hip, knee, ankle_w, leg = _legs(size, pose, pelvis)
    shoulder, elbow, wrist, upper, fore = _arms(size, pose, trunk, neck)
    up = trunk.apply([0.0, 0.0, 1.0])
    r = size.radius
    limbs = [
        (pose.pelvis_w + WAIST * up, neck - 0.6 * r("trunk") * up, r("trunk")),
        (neck + 0.4 * size.head * up, neck + (size.head - r("head")) * up, r("head")),
    ]
    for ends, name in (
        ((hip, knee), "thigh"),
        ((knee, ankle_w), "shank"),
        ((shoulder, elbow), "upper arm"),
        ((elbow, wrist), "forearm"),
    ):
        for k in (RIGHT, LEFT):
            begin, end = ends[0][:, k], ends[1][:, k]
            # The sphere at the end of a capsule must not extend past the joint.
            short = r(name) * (end - begin) / np.linalg.norm(end - begin, axis=1, keepdims=True)
            limbs.append((begin, end - 0.5 * short, r(name)))
    sites = [
        (shoulder[:, RIGHT], upper[RIGHT], _on("upper arm", size, -0.5 * size.upper_arm, 0.0, -1)),
        (elbow[:, RIGHT], fore[RIGHT], _on("forearm", size, 0.04 - size.forearm, 0.0, -1)),
        (pose.pelvis_w, pelvis, _on("trunk", size, 0.06, 0.2, -1)),
        (elbow[:, LEFT], fore[LEFT], _on("forearm", size, 0.04 - size.forearm, 0.0, 1)),
        (hip[:, RIGHT], leg[RIGHT], _on("thigh", size, 0.06 - size.thigh, 0.6, -1)),
        (hip[:, LEFT], leg[LEFT], _on("thigh", size, 0.06 - size.thigh, 0.6, 1)),
    ]
    return BodySamples(
        t=t,
        pos_w=np.stack([origin + frame.apply(offset) for origin, frame, offset in sites], axis=1),
        q_wb=one_sided(
            np.stack([frame.as_quat(scalar_first=True) for _, frame, _ in sites], axis=1)
        ),
        start_w=np.stack([begin for begin, _, _ in limbs], axis=1),
        end_w=np.stack([end for _, end, _ in limbs], axis=1),
        radius=np.array([radius for _, _, radius in limbs]),
        hides=np.isin(LIMBS, HIDING),
    )


def ankles(size: SkeletonSize, pose: Pose) -> F64:
    """Return the ankles over the balls of the feet, (time, side, 3) [m]."""
    c, s = np.cos(pose.heel_lift), np.sin(pose.heel_lift)
    back = size.foot * c - size.ankle * s
    offset = np.stack(
        [
            -back * np.cos(pose.foot_yaw),
            -back * np.sin(pose.foot_yaw),
            size.foot * s + size.ankle * c,
        ],
        axis=-1,
    )
    return np.asarray(pose.ball_w + offset)


def leg_stretch(size: SkeletonSize, pose: Pose) -> F64:
    """Return the distance from hip to ankle over the length of a straight leg, (time, side)."""
    pelvis = Rotation.from_euler(
        "ZY", np.column_stack([pose.heading + pose.pelvis_turn, pose.pelvis_tilt])
    )
    span = ankles(size, pose) - _hips(size, pose, pelvis)
    return np.asarray(np.linalg.norm(span, axis=-1) / (size.thigh + size.shank))


def _hips(size: SkeletonSize, pose: Pose, pelvis: Rotation) -> F64:
    return np.stack([pose.pelvis_w + pelvis.apply([0.0, s * size.hip, 0.0]) for s in SIDES], axis=1)


def _legs(size: SkeletonSize, pose: Pose, pelvis: Rotation) -> tuple[F64, F64, F64, list[Rotation]]:
    """Return hips, knees and ankles, (time, side, 3) [m], and the frames of the thighs."""
    hip, ankle = _hips(size, pose, pelvis), ankles(size, pose)
    span = ankle - hip
    length = np.linalg.norm(span, axis=-1, keepdims=True)
    down = span / length
    reach = np.minimum(length, 0.9999 * (size.thigh + size.shank))
    cosine = (size.thigh**2 + reach**2 - size.shank**2) / (2.0 * size.thigh * reach)
    knees_to = 0.5 * (pose.foot_yaw + (pose.heading + pose.pelvis_turn)[:, None])
    front = np.stack([np.cos(knees_to), np.sin(knees_to), np.zeros_like(knees_to)], axis=-1)
    front -= np.sum(front * down, axis=-1, keepdims=True) * down
    front /= np.linalg.norm(front, axis=-1, keepdims=True)
    thigh = cosine * down + np.sqrt(1.0 - cosine**2) * front
    hinge = np.cross(front, down)
    axes = np.stack([np.cross(hinge, -thigh), hinge, -thigh], axis=-1)
    frames = [Rotation.from_matrix(axes[:, k]) for k in (RIGHT, LEFT)]
    return hip, hip + size.thigh * thigh, ankle, frames


def _arms(
    size: SkeletonSize, pose: Pose, trunk: Rotation, neck: F64
) -> tuple[F64, F64, F64, list[Rotation], list[Rotation]]:
    """Return shoulders, elbows, wrists, (time, side, 3) [m]; frames of upper arms and forearms."""
    upper, fore, joints = [], [], []
    for k, side in enumerate(SIDES):
        turns = np.column_stack(
            [side * pose.abduction[:, k], -pose.flexion[:, k], side * pose.roll[:, k]]
        )
        upper.append(trunk * Rotation.from_euler("XYZ", turns))
        fore.append(upper[k] * Rotation.from_euler("Y", -pose.elbow[:, k : k + 1]))
        shoulder = neck + trunk.apply([0.0, side * size.shoulder, 0.0])
        elbow = shoulder + upper[k].apply([0.0, 0.0, -size.upper_arm])
        joints.append((shoulder, elbow, elbow + fore[k].apply([0.0, 0.0, -size.forearm])))
    shoulder, elbow, wrist = (np.stack(joint, axis=1) for joint in zip(*joints, strict=True))
    return shoulder, elbow, wrist, upper, fore


def _on(limb: str, size: SkeletonSize, up: float, front: float, side: int) -> F64:
    """Return a point on the skin of a limb, relative to its upper joint [m].

    Args:
        limb: Name of the limb.
        size: Size of the person.
        up: Position along the axis [m].
        front: Angle from the outside towards the front [rad].
        side: -1 right, 1 left.
    """
    out = size.radius(limb) + SKIN
    return np.array([out * np.sin(front), side * out * np.cos(front), up])
