"""The report of a calibration: results, outliers and residual errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agents.evaluation.calibrate import CalibrateResult
from agents.reports.page import Page
from agents.reports.style import in_style, new_figure
from tracking.calibration import MagResult
from tracking.geometry import GRAVITY
from tracking.measurements import Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_NODES = 6
"""Largest number of nodes in figures; tables have all."""
MAX_POINTS = 4000
"""Approximate number of points per scatter plot."""

IMU_HEADER = ["node", "rest s", "gyr offset mrad/s", "+-", "acc offset m/s2", "acc scale", "from"]
MAG_HEADER = ["node", "from", "offset uT", "field uT", "seen", "uneven before", "after"]
UWB_HEADER = ["node", "offset b [m]"]


def calibration_report(r: CalibrateResult) -> str:
    """Return the report as one HTML page."""
    page = Page("Calibration report", f"Sensor errors found in {r.log.name}")
    if r.imu:
        page.heading("Gyroscope and accelerometer")
        page.table(IMU_HEADER, imu_rows(r))
        page.figure(
            _rest(r), "Lengths of turn rate and specific force; shaded where the node lay still."
        )
    if r.mag:
        page.heading("Magnetometer")
        page.table(MAG_HEADER, mag_rows(r))
        page.figure(
            _clouds(r), "Readings before and after; corrected ones should lie on the circle."
        )
    if r.uwb is not None:
        page.heading("Ranges")
        page.text(uwb_text(r))
        page.table(UWB_HEADER, uwb_rows(r))
        page.figure(
            _residuals(r), "Range minus true distance, before (left) and after calibration (right)."
        )
    for line in refusals(r):
        page.text(line)
    return page.render()


def imu_rows(r: CalibrateResult) -> list[list[str]]:
    """Return one row per node, as `IMU_HEADER`."""
    return [
        [
            str(n),
            f"{one.rest.duration:.1f}",
            _numbers(1e3 * np.array(one.calibration.gyr_offset), 2),
            f"{1e3 * one.gyr_se.max():.2f}",
            _numbers(one.calibration.acc_offset, 3),
            _numbers(one.calibration.acc_scale, 4),
            f"{one.acc_method}, {one.n_poses} poses, {one.n_seen} of 3 directions",
        ]
        for n, one in r.imu.items()
    ]


def mag_rows(r: CalibrateResult) -> list[list[str]]:
    """Return one row per node, as `MAG_HEADER`."""
    return [
        [
            str(n),
            one.method,
            _numbers(one.calibration.mag_offset, 2),
            f"{one.field:.1f}",
            f"{100 * one.coverage:.0f} %",
            f"{100 * one.residual_before:.1f} %",
            f"{100 * one.residual_after:.1f} %",
        ]
        for n, one in r.mag.items()
    ]


def uwb_rows(r: CalibrateResult) -> list[list[str]]:
    """Return one row per node, as `UWB_HEADER`."""
    offset = r.uwb.calibration.offset if r.uwb else {}
    return [[str(n), f"{b:+.3f}"] for n, b in offset.items()]


def uwb_text(r: CalibrateResult) -> str:
    """Return a summary of the UWB calibration as text, empty if there is none."""
    u = r.uwb
    if u is None:
        return ""
    slope = (
        f"Slope {u.calibration.slope:.4f} (standard error {u.slope_se:.4f} if errors were "
        "independent)."
        if u.slope_fitted
        else "Distances spread too little for a slope; it was left at 1."
    )
    split = "" if u.separable else " Only sums of two offsets are known; they were split evenly."
    return (
        f"{slope}{split} {100 * u.inlier_share:.0f} % of {u.used.sum()} ranges agree; the rest "
        f"of their error has a standard deviation of {u.residual_std:.3f} m. Median error "
        f"{np.median(u.error_before[u.used]):+.3f} m before, "
        f"{np.median(u.error_after[u.used]):+.3f} m after. Valid in line of sight, from "
        f"{u.distance[0]:.1f} to {u.distance[1]:.1f} m."
    )


def refusals(r: CalibrateResult) -> list[str]:
    """Return one line per node that was not calibrated."""
    return [f"Node {n} is not calibrated: {why}." for n, why in r.refused.items()]


def _numbers(values: object, digits: int) -> str:
    return "-" if values is None else ", ".join(f"{v:.{digits}f}" for v in np.asarray(values))


@in_style
def _rest(r: CalibrateResult) -> Figure:

    drawn = list(r.imu.items())[:MAX_NODES]
    figure = new_figure(11, 2.6 * len(drawn))
    axes = figure.subplots(len(drawn), 2, squeeze=False)
    block, index_of = r.log.block, r.log.constellation.index_of
    for (n, one), (left, right) in zip(drawn, axes, strict=True):
        mine = block.valid[0] & (block.kind[0] == Kind.IMU) & (block.i[0] == index_of[n])
        t, imu = block.t[0, mine], block.values[0, mine, :6]
        left.plot(t, np.linalg.norm(imu[:, :3], axis=1), color="C0", lw=0.6, rasterized=True)
        right.plot(t, np.linalg.norm(imu[:, 3:], axis=1), color="C1", lw=0.6, rasterized=True)
        right.axhline(GRAVITY, color="k", lw=0.6, ls="--")
        low, high = np.percentile(np.linalg.norm(imu[:, 3:], axis=1), [0.2, 99.8])
        right.set_ylim(min(low, GRAVITY) - 0.5, max(high, GRAVITY) + 0.5)
        for ax in (left, right):
            for start, stop in one.rest.span:
                ax.axvspan(start, stop, color="C2", alpha=0.25, lw=0)
            ax.set_xlabel("t [s]")
        left.set(title=f"node {n}", ylabel="|gyr| [rad/s]")
        right.set(title=f"node {n}", ylabel="|acc| [m/s2]")
    return figure


@in_style
def _clouds(r: CalibrateResult) -> Figure:

    drawn = list(r.mag.items())[:MAX_NODES]
    figure = new_figure(11, 5.0 * len(drawn))
    axes = figure.subplots(len(drawn), 2, squeeze=False)
    block, index_of = r.log.block, r.log.constellation.index_of
    corrected = r.calibration.apply(block, r.log.constellation)
    for (n, one), row in zip(drawn, axes, strict=True):
        mine = block.valid[0] & (block.kind[0] == Kind.MAG) & (block.i[0] == index_of[n])
        before, after = block.values[0, mine, :3], corrected.values[0, mine, :3]
        for ax, (a, b) in zip(row, ((0, 1), (0, 2)), strict=True):
            _cloud(ax, one, before[:, [a, b]], after[:, [a, b]], circle=one.method == "ellipsoid")
            ax.set(title=f"node {n}", xlabel=f"{'xyz'[a]} [uT]", ylabel=f"{'xyz'[b]} [uT]")
        if one.method != "ellipsoid":
            _circle(row[0], one.field)
        row[0].legend(loc="best")
    return figure


def _cloud(
    ax: Axes, one: MagResult, before: np.ndarray, after: np.ndarray, *, circle: bool
) -> None:
    """Plot magnetometer readings in one plane, before and after calibration."""
    thin = slice(None, None, 1 + len(before) // MAX_POINTS)
    ax.plot(*before[thin].T, ".", color="0.7", ms=2, rasterized=True, label="before")
    ok = one.inlier[thin]
    ax.plot(*after[thin][ok].T, ".", color="C0", ms=2, rasterized=True, label="after")
    if not ok.all():
        ax.plot(*after[thin][~ok].T, "x", color="C3", ms=4, label="outliers")
    if circle:
        _circle(ax, one.field)
    ax.plot(0, 0, "k+", ms=9)
    # Outliers may be outside the axes.
    reach = 1.1 * float(np.abs([before[one.inlier], after[one.inlier]]).max())
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")


def _circle(ax: Axes, radius: float) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(radius * np.cos(angle), radius * np.sin(angle), color="k", lw=0.8)


@in_style
def _residuals(r: CalibrateResult) -> Figure:

    figure = new_figure(11, 4.0)
    axes = figure.subplots(1, 2, sharey=True)
    u, table = r.uwb, r.ranges
    if u is None or table is None:
        return figure
    for ax, error, title in zip(
        axes, (u.error_before, u.error_after), ("before", "after"), strict=True
    ):
        groups = (
            (u.inlier, "C0", f"agree ({u.inlier.sum()})"),
            (u.used & ~u.inlier, "C3", f"outliers ({(u.used & ~u.inlier).sum()})"),
            (table.known & ~u.used, "0.7", f"not used ({(table.known & ~u.used).sum()})"),
        )
        for chosen, colour, label in groups:
            rows = np.nonzero(chosen)[0]
            rows = rows[:: 1 + len(rows) // MAX_POINTS]
            if len(rows):
                ax.plot(
                    table.true[rows],
                    error[rows],
                    ".",
                    color=colour,
                    ms=2,
                    label=label,
                    rasterized=True,
                )
        ax.axhline(0.0, color="k", lw=0.8)
        ax.set(title=title, xlabel="true distance [m]")
    shown = np.concatenate([u.error_before[u.used], u.error_after[u.used]])
    low, high = np.percentile(shown, [0.5, 99.5])
    axes[0].set(ylabel="range - distance [m]", ylim=(min(low, -0.2) * 1.3, max(high, 0.2) * 1.3))
    axes[1].legend(loc="best", markerscale=4)
    return figure
