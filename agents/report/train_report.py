"""The report of a training run: learning curves and the configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from agents.report.page import Page, metres
from agents.settings import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from agents.train.config import TrainConfig

Rows = Sequence[dict[str, Any]]


def train_report(config: TrainConfig, rows: Rows) -> str:
    """The page.

    Args:
        config: Of the run.
        rows: What was measured after every leg.
    """
    env, last = config.env, rows[-1]
    page = Page(
        f"Training: {env.task} on {env.observation}",
        f"{last['frames']:,} frames in {last['seconds'] / 60.0:.1f} minutes, seed {config.seed}",
    )
    page.heading("Learning curves")
    page.figure(
        curves([("", rows)]),
        f"{config.eval_episodes} episodes in {', '.join(env.scenarios)} after every leg, the same "
        "every time, driven by the most likely action; errors from 10 s on.",
    )
    page.heading("Legs")
    page.table(
        ["leg", "frames", "level", "return", "formation [m]", "tracking [m]", "collisions/min"],
        [
            [
                str(r["leg"]),
                f"{r['frames']:,}",
                "-" if r["level"] is None else str(r["level"]),
                f"{r['return']:.3f}",
                metres(r["formation_error"]),
                metres(r["tracking_error"]),
                f"{r['collisions_per_min']:.2f}",
            ]
            for r in rows
        ],
    )
    page.heading("Configuration")
    flat: dict[str, Any] = {}
    for name, value in to_json(config).items():
        flat.update(value if isinstance(value, dict) else {name: value})
    page.table(["setting", "value"], [[k, str(v)] for k, v in flat.items()])
    return page.render()


def curves(runs: Sequence[tuple[str, Rows]]) -> Figure:
    """Return, formation error and collisions over the frames of some runs.

    Args:
        runs: Label and rows of each; runs of equal labels are drawn alike.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 3.4), layout="constrained")
    axes = figure.subplots(1, 3)
    names = ("return", "formation_error", "collisions_per_min")
    titles = ("mean return of a decision", "formation error [m]", "collisions per minute")
    labels = list(dict.fromkeys(label for label, _ in runs))
    for axis, name, title in zip(axes, names, titles, strict=True):
        shown = set()
        for label, rows in runs:
            colour = f"C{labels.index(label)}"
            axis.plot(
                [r["frames"] / 1e6 for r in rows],
                [r[name] for r in rows],
                color=colour,
                label=label if label and label not in shown else None,
                marker="." if len(rows) < 30 else None,
                alpha=0.8,
            )
            shown.add(label)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("million frames")
        axis.grid(alpha=0.3)
        if name == "formation_error":
            axis.set_yscale("log")
        if any(labels):
            axis.legend(fontsize=8)
    return figure
