"""Recorded motion of a person: clips of motion capture, joined to a run of any length.

Each clip is entered and left at the most similar poses, and rotated so that the person faces the
same direction. Both clips are blended for a short time: feet slide, and an arm that is up in one
clip and down in the other is shortened meanwhile.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import make_interp_spline

from relpos_env.people.clips import Clip
from relpos_env.people.easing import ease, ease_integral
from relpos_env.people.motion import SITES, BodySamples, one_sided
from tracking.arrays import F64, I64
from tracking.geometry import quat_conjugate, quat_from_yaw, quat_multiply, rotate

BLEND = 0.8
"""[s] Duration of the blend of two clips."""
DRIFT = 8.0
"""[s] Time after the blend in which the person returns to the recorded position of the clip."""
LEAVE, ENTER = 5.0, 1.0
"""[s] Parts at the end of a clip and the start of the next, searched for similar poses."""
LOOK_AHEAD = 0.2
"""[s] Time by which speeds are multiplied in the comparison of poses."""
START = 1.5
"""[s] Time from the first pose, held, to the full speed of the recording."""


def recorded_body(
    clips: list[Clip], seconds: float, still: float, dt: float, rng: np.random.Generator
) -> BodySamples:
    """Return a person who holds a first pose and then moves as recorded.

    Args:
        clips: Clips to play, all of one rate.
        seconds: Length of the run [s].
        still: Duration of the initial rest [s].
        dt: Time step of the samples [s].
        rng: Generator of the order of the clips and of the first heading.
    """
    n = len(clips)
    order = [int(k) for k in rng.permutation(n)]
    run = clips[order[0]].turned(float(rng.uniform(-np.pi, np.pi)))
    calm = int(_speed(run.points)[: round(ENTER / run.dt)].mean(axis=1).argmin())
    run = _cut(run, slice(calm, None))
    pieces = [run]
    while sum(len(piece.points) for piece in pieces) * run.dt < seconds - still + 1.0:
        if len(order) == 1:
            order += [int(k) for k in rng.permutation(n)]
        order.pop(0)
        pieces[-1:] = _join(pieces[-1], clips[order[0]])
    run = replace(
        run,
        points=np.concatenate([piece.points for piece in pieces]),
        q_wb=np.concatenate([piece.q_wb for piece in pieces]),
    )
    t = dt * np.arange(round(seconds / dt) + 1, dtype=np.float64)
    played = START * ease_integral(np.maximum(t - still, 0.0) / START)
    grid = run.dt * np.arange(len(run.points), dtype=np.float64)
    points = make_interp_spline(grid, run.points, k=5)(played)
    q = make_interp_spline(grid, one_sided(run.q_wb), k=5)(played)
    start, end = np.split(points[:, len(SITES) :], 2, axis=1)
    return BodySamples(
        t=t,
        pos_w=points[:, : len(SITES)],
        q_wb=q / np.linalg.norm(q, axis=-1, keepdims=True),
        start_w=start,
        end_w=end,
        radius=run.radius,
        hides=run.hides,
    )


def _join(run: Clip, clip: Clip) -> tuple[Clip, Clip]:
    """Return two clips cut at their most similar poses, with the second blended to the first."""
    n, stride = round(BLEND / run.dt), max(round(0.05 / run.dt), 1)
    last, most = len(run.points) - n, len(clip.points) - n - 1
    leave = np.arange(max(last - round(LEAVE / run.dt), 0), last, stride, dtype=np.int64)
    enter = np.arange(0, min(round(ENTER / run.dt), most), stride, dtype=np.int64)
    apart = _features(run, leave)[:, None] - _features(clip, enter)[None]
    a, b = np.unravel_index(int((apart**2).mean(axis=2).argmin()), apart.shape[:2])
    i, j = int(leave[a]), int(enter[b])
    clip = _cut(clip.turned(float(run.place()[1][i] - clip.place()[1][j])), slice(j, None))
    points, q = clip.points.copy(), clip.q_wb.copy()
    shift = run.place()[0][i] - clip.place()[0][0]
    after = run.dt * np.arange(len(points), dtype=np.float64) - BLEND
    points[..., :2] += (1.0 - ease(after / DRIFT))[:, None, None] * shift
    weight = ease(np.arange(n, dtype=np.float64) / n)[:, None, None]
    points[:n] = (1.0 - weight) * run.points[i : i + n] + weight * points[:n]
    q[:n] = _mixed(run.q_wb[i : i + n], q[:n], weight[..., 0])
    return _cut(run, slice(0, i)), replace(clip, points=points, q_wb=q)


def _mixed(old: F64, new: F64, weight: F64) -> F64:
    """Return orientations between old and new ones, with the same sense of rotation at all times.

    Args:
        old: Old orientations, (time, site, 4).
        new: New orientations, (time, site, 4).
        weight: Share of the rotation to the new ones, (time, 1) [-].
    """
    turn = quat_multiply(quat_conjugate(old), new)
    turn = np.where(turn[..., :1].sum(axis=0) < 0.0, -turn, turn)
    length = np.linalg.norm(turn[..., 1:], axis=-1)
    half = weight * np.arctan2(length, turn[..., 0])
    axis = turn[..., 1:] / np.maximum(length, 1e-12)[..., None]
    part = np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * axis], axis=-1)
    return quat_multiply(old, part)


def _cut(clip: Clip, part: slice) -> Clip:
    return replace(clip, points=clip.points[part], q_wb=clip.q_wb[part])


def _features(clip: Clip, k: I64) -> F64:
    """Return poses and speeds in the frame of the person, (sample, feature) [m]."""
    middle, heading = clip.place()
    points = clip.points.copy()
    points[..., :2] -= middle[:, None]
    velocity = np.gradient(clip.points, clip.dt, axis=0)[k]
    back = quat_from_yaw(-heading[k])[:, None]
    seen = [rotate(back, points[k]), LOOK_AHEAD * rotate(back, velocity)]
    return np.concatenate([part.reshape(len(k), -1) for part in seen], axis=1)


def _speed(points: F64) -> F64:
    """Return the distance moved per sample, (time, point) [m]."""
    return np.asarray(np.linalg.norm(np.gradient(points, axis=0), axis=-1))
