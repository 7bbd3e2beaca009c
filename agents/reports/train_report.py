"""The report of a training run: learning curves and the configuration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from agents.reports.page import Page, metres
from agents.reports.style import in_style, new_figure, plain_ticks
from agents.settings import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from agents.training.choice import Choice
    from agents.training.config import TrainConfig

Rows = Sequence[dict[str, Any]]


def train_report(config: TrainConfig, rows: Rows, choice: Choice) -> str:
    """Return the report as one HTML page.

    Args:
        config: Configuration of the runs.
        rows: Records of all evaluation intervals of all runs, with seeds.
        choice: Result of the model selection.
    """
    env, last = config.env, rows[-1]
    seeds = list(dict.fromkeys(r["seed"] for r in rows))
    kept = choice.measured
    page = Page(
        f"Training: {env.task} on {env.observation}",
        f"{last['frames']:,} frames in {last['seconds'] / 60.0:.1f} minutes, "
        f"{_seeds(seeds)}; kept: seed {kept['seed']} after interval {kept['interval']}",
    )
    page.heading("Learning curves")
    page.figure(
        curves(
            [
                (f"seed {s}" if len(seeds) > 1 else "", [r for r in rows if r["seed"] == s])
                for s in seeds
            ]
        ),
        f"{config.eval_episodes} episodes in {', '.join(env.scenarios)} after every interval, the "
        "same every time, driven by the most likely action; errors from 10 s on.",
    )
    page.heading("The choice")
    page.table(
        ["seed", "interval", "return", "formation [m]", "tracking [m]", "collisions/min"],
        [[str(r["seed"]), str(r["interval"]), *_measured(r)] for r in choice.rows],
    )
    page.text(
        f"The policy with the highest return in {config.choice_episodes} other episodes is kept, "
        "among the best by the curves and the last of every run."
    )
    page.heading("Evaluation intervals")
    page.table(
        [
            "seed",
            "interval",
            "frames",
            "level",
            "return",
            "formation [m]",
            "tracking [m]",
            "collisions/min",
        ],
        [
            [
                str(r["seed"]),
                str(r["interval"]),
                f"{r['frames']:,}",
                "-" if r["level"] is None else str(r["level"]),
                *_measured(r),
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


def _measured(row: dict[str, Any]) -> list[str]:
    """Return the metrics of a policy for both tables."""
    return [
        f"{row['return']:.3f}",
        metres(row["formation_error"]),
        metres(row["tracking_error"]),
        f"{row['collisions_per_min']:.2f}",
    ]


def _seeds(seeds: Sequence[int]) -> str:
    return f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"


@in_style
def curves(runs: Sequence[tuple[str, Rows]]) -> Figure:
    """Draw return, formation error and collisions over the agent steps of runs.

    Args:
        runs: Label and records of each run; runs with equal labels have the same style.
    """
    figure = new_figure(10.0, 3.4)
    axes = figure.subplots(1, 3)
    names = ("return", "formation_error", "collisions_per_min")
    titles = ("mean return of a decision", "formation error [m]", "collisions per minute")
    counts = Counter(label for label, _ in runs)
    labels = list(counts)
    for axis, name, title in zip(axes, names, titles, strict=True):
        shown = set()
        for label, rows in runs:
            colour = f"C{labels.index(label)}"
            axis.plot(
                [r["frames"] / 1e6 for r in rows],
                [r[name] for r in rows],
                color=colour,
                label=f"{label}, {counts[label]} runs" if label and label not in shown else None,
                marker="." if len(rows) < 30 else None,
                alpha=0.8,
            )
            shown.add(label)
        axis.set_title(title)
        axis.set_xlabel("million frames")
        if name == "formation_error":
            axis.set_yscale("log")
            plain_ticks(axis.yaxis)
        if any(labels):
            axis.legend()
    return figure
