"""The report of tracked logs: trajectories, errors with 3-sigma bands, ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agents.evaluation.estimates_csv import pair_name
from agents.evaluation.track import ERRORS, TrackResult
from agents.reports.page import Page, metres, percent
from agents.reports.style import in_style, new_figure
from tracking.estimate import Status
from tracking.findings import KINDS
from tracking.measurements import Kind
from tracking.metrics.integrity import LIMIT, SIGMAS
from tracking.metrics.score import errors_after

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_PAIRS = 6
"""Largest number of pairs in figures; tables have all."""


def track_report(results: Sequence[TrackResult]) -> str:
    """Return the report of all logs and filters as one HTML page."""
    page = Page("Tracking report", "Relative positions from UWB ranges and inertial sensors")
    page.heading("Errors")
    page.text(
        "Root-mean-square errors of the relative positions in metres: as they are (rmse), after "
        "one constant yaw (rmse_yaw), after the best rotation at each instant (rmse_shape), and "
        "after the best rotation and reflection (rmse_mirror). ok: share of the scored time; "
        f"wrong: share of the run in which a pair was ok and off by more than {LIMIT:g} m and "
        f"{SIGMAS:g} of its own standard deviations. NEES and NIS are 1 where the covariance is "
        "right. bound: expected errors of an efficient filter, if the assumed noise is true; a "
        "smoother, which also uses later measurements, can be better."
    )
    header = [
        "log", "filter", "rmse", "rmse_yaw", "yaw deg", "rmse_shape", "rmse_mirror", "ok",
        "wrong", "nees", "nis",
    ]  # fmt: skip
    rows = []
    for r in results:
        s = r.summary
        figures = [metres(s[k]) for k in ("rmse", "rmse_yaw")]
        others = [metres(s[k]) for k in ("rmse_shape", "rmse_mirror")]
        others += [percent(s["ok_share"]), percent(s["integrity_share"], 2)]
        others += [metres(s[k]) for k in ("nees", "nis")]
        yaw = "-" if s["yaw_deg"] is None else f"{s['yaw_deg']:.1f}"
        rows.append([s["log"], r.method, *figures, yaw, *others])
        if r.expected:
            world, turned, shape, _ = (metres(r.expected.get(name)) for name in ERRORS)
            rows.append(["", "bound", world, turned, "", shape, *[""] * 5])
    page.table(header, rows)
    for r in results:
        _add_result(page, r)
    return page.render()


def _add_result(page: Page, r: TrackResult) -> None:
    log = r.log
    page.heading(f"{log.name}, {r.method}")
    page.text(
        f"{log.constellation.n_nodes} nodes, {log.duration:.0f} s, {log.n_ranges} ranges, of "
        f"which {r.n_rejected} were refused as outliers; {sum(log.skipped.values())} bad rows "
        f"skipped. Scored from {r.skip:g} s after the first range; of what has truth then, there "
        f"was an estimate for {percent(r.score.coverage)}, with status ok for "
        f"{percent(r.score.ok_share)}."
    )
    for found in r.findings:
        page.text(f"{found.severity.capitalize()}: {found.text}; {KINDS[found.name].remedy}.")
    constellation = log.constellation
    rows = []
    for p in range(constellation.n_pairs):
        if np.isfinite(r.score.pair_rmse[p]):
            figures = (r.score.pair_rmse, r.score.pair_rmse_yaw, r.score.pair_rmse_shape)
            rows.append([pair_name(constellation, p), *(metres(f[p]) for f in figures)])
    if rows:
        page.table(["pair", "rmse", "rmse_yaw", "rmse_shape"], rows)
    pairs = _pairs_to_draw(r)
    if not pairs:
        page.text("No pair has a moving node, so there is nothing to draw.")
        return
    n_left_out = int(_is_moving(r).sum()) - len(pairs)
    more = f" The first {len(pairs)} pairs; {n_left_out} more are not drawn." if n_left_out else ""
    page.figure(
        _trajectories(r, pairs),
        f"Relative trajectories from above, seen from node i, after one constant yaw.{more}",
    )
    page.figure(
        _errors(r, pairs),
        "Position error of each axis after one constant yaw, with the filter's own 3-sigma band; "
        "shaded where the pair is not ok.",
    )
    page.figure(_ranges(r, pairs), "Measured ranges, estimated and true distance.")


def _pairs_to_draw(r: TrackResult) -> list[int]:
    return [int(p) for p in np.nonzero(_is_moving(r))[0][:MAX_PAIRS]]


def _is_moving(r: TrackResult) -> np.ndarray:
    constellation = r.log.constellation
    return np.asarray(~constellation.is_static[constellation.pairs].all(axis=1))


def _known(r: TrackResult, p: int) -> np.ndarray:
    """Return the mask of times at which a pair has an estimate."""
    known: np.ndarray = ~np.isin(r.estimate.status[:, p], (Status.ABSENT, Status.STARTING))
    return known


def _is_ok(r: TrackResult, p: int) -> np.ndarray:
    is_ok: np.ndarray = r.estimate.status[:, p] == Status.OK
    return is_ok


def _finish(figure: Figure, axes: np.ndarray, n: int) -> Figure:
    """Put the legend above the axes, where it hides nothing, and remove empty axes."""
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    for ax in axes[n:]:
        ax.remove()
    return figure


def _axes(n: int, height: float) -> tuple[Figure, np.ndarray]:

    columns = min(n, 3)
    lines = -(-n // columns)
    figure = new_figure(11, height * lines)
    return figure, np.atleast_1d(figure.subplots(lines, columns, squeeze=False)).ravel()


@in_style
def _trajectories(r: TrackResult, pairs: list[int]) -> Figure:
    figure, axes = _axes(len(pairs), 3.6)
    yaw = np.radians(r.score.yaw_deg or 0.0)
    c, s = np.cos(yaw), np.sin(yaw)
    for ax, p in zip(axes, pairs, strict=False):
        x, y = r.estimate.pos_ij_w[:, p, 0], r.estimate.pos_ij_w[:, p, 1]
        xy = np.stack([c * x - s * y, s * x + c * y])
        known, is_ok = _known(r, p), _is_ok(r, p)
        true = np.where(r.has_truth[:, p], r.truth_ij_w[:, p, :2].T, np.nan)
        ax.plot(*true, color="0.6", lw=2.2, label="truth")
        unsure = np.where(known & ~is_ok, xy, np.nan)
        ax.plot(*unsure, ".", color="C1", ms=1.5, label="estimate, not ok")
        ax.plot(*np.where(is_ok, xy, np.nan), color="C0", lw=0.9, label="estimate, ok")
        ax.plot(0, 0, "k+", ms=9)
        ax.set(title=pair_name(r.log.constellation, p), xlabel="x [m]", ylabel="y [m]")
        ax.set_aspect("equal", "datalim")
    return _finish(figure, axes, len(pairs))


@in_style
def _errors(r: TrackResult, pairs: list[int]) -> Figure:
    figure, axes = _axes(len(pairs), 2.6)
    error = errors_after(r.estimate, r.truth_ij_w, np.radians(r.score.yaw_deg or 0.0))
    for ax, p in zip(axes, pairs, strict=False):
        ok = _known(r, p) & r.has_truth[:, p]
        t = r.estimate.t
        for axis, name in enumerate("xyz"[: r.log.constellation.dimensions]):
            ax.plot(t, np.where(ok, error[:, p, axis], np.nan), f"C{axis}", lw=0.8, label=name)
        band = np.where(ok, 3.0 * r.estimate.pos_std[:, p].max(axis=1), np.nan)
        ax.fill_between(t, -band, band, color="0.85", zorder=0, label="3 sigma")
        unsure = _known(r, p) & ~_is_ok(r, p)
        over = ax.get_xaxis_transform()
        ax.fill_between(t, 0, 1, where=unsure, transform=over, color="C1", alpha=0.12, lw=0,
                        zorder=-1, label="not ok")  # fmt: skip
        ax.set(title=pair_name(r.log.constellation, p), xlabel="t [s]", ylabel="error [m]")
        limit = np.nanpercentile(np.abs(error[ok, p]), 99) * 1.3 if ok.any() else 1.0
        ax.set_ylim(-max(limit, 0.2), max(limit, 0.2))
    return _finish(figure, axes, len(pairs))


@in_style
def _ranges(r: TrackResult, pairs: list[int]) -> Figure:
    figure, axes = _axes(len(pairs), 2.6)
    block = r.log.block
    for ax, p in zip(axes, pairs, strict=False):
        i, j = r.log.constellation.pairs[p]
        mine = (block.kind[0] == Kind.RANGE) & (
            ((block.i[0] == i) & (block.j[0] == j)) | ((block.i[0] == j) & (block.j[0] == i))
        )
        ax.plot(
            block.t[0, mine],
            block.values[0, mine, 0],
            ".",
            color="0.75",
            ms=2,
            label="ranges",
            rasterized=True,
        )
        ok, seen = _known(r, p), r.has_truth[:, p]
        t, length = r.estimate.t, np.linalg.norm(r.estimate.pos_ij_w[:, p], axis=1)
        ax.plot(t, np.where(ok, length, np.nan), color="C0", lw=0.9, label="estimate")
        true = np.linalg.norm(r.truth_ij_w[:, p], axis=1)
        ax.plot(t, np.where(seen, true, np.nan), "--", color="k", lw=0.8, label="truth")
        ax.set(title=pair_name(r.log.constellation, p), xlabel="t [s]", ylabel="distance [m]")
        if mine.any():
            top = np.percentile(block.values[0, mine, 0], 99.5) * 1.15
            ax.set_ylim(0, max(float(top), 0.5))
    return _finish(figure, axes, len(pairs))
