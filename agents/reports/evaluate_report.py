"""The report of an evaluation: metrics, those of the paper, and figures of all runs."""

from __future__ import annotations

import json

from agents.evaluation.evaluate import EvaluateResult
from agents.evaluation.lost import FOR, WRONG
from agents.evaluation.run import SKIP
from agents.evaluation.targets import NEAR
from agents.reports import evaluate_figures as figures
from agents.reports.page import Page, metres, percent
from agents.reports.style import svg
from tracking.metrics.integrity import LIMIT, SIGMAS

TARGETS = ["case", "filter", "figure", "reached", "asked", "target", ""]
"""Names of the columns of the table of targets."""
_FIGURES = [
    "rmse", "rmse_yaw", "rmse_shape", "bound_yaw", "yaw/b", "shape/b",
    "gospa", "lost", "ok", "wrong", "worst s", "nees", "nis", "us",
]  # fmt: skip


def header(result: EvaluateResult) -> list[str]:
    """Return the names of the columns; with the paper's only if it reports an error."""
    return ["case", "filter", *(["paper"] if has_paper(result) else []), *_FIGURES]


def has_paper(result: EvaluateResult) -> bool:
    """Return whether the paper reports an error of any case."""
    return any(c.paper is not None for c in result.cases)


def rows(result: EvaluateResult) -> list[list[str]]:
    """Return the table, one row per case and filter."""
    cells = []
    before = ""
    for r in result.records:
        lengths = [metres(r[k]) for k in ("rmse", "rmse_yaw", "rmse_shape", "bound_yaw")]
        ratios = [_number(r[k]) for k in ("ratio_bound", "ratio_shape")]
        shares = [percent(r[k], 2) for k in ("ok_share", "integrity_share")]
        numbers = [_number(r[k]) for k in ("integrity_worst_s", "nees", "nis")]
        rest = [f"{r['lost_runs']}/{r['seeds']}", *shares, *numbers]
        name = r["case"] if r["case"] != before else ""
        before = r["case"]
        head = [name, r["filter"], *([metres(r["paper"])] if has_paper(result) else [])]
        cells.append(
            [*head, *lengths, *ratios, metres(r["gospa"]), *rest, f"{r['us_per_round']:.0f}"]
        )
    return cells


def notes(result: EvaluateResult) -> list[str]:
    """Return notes on the table, one per line."""
    lines = [
        f"{result.seeds} seeds of {result.seconds:g} s, scored from {SKIP:g} s after the first "
        "range. Errors [m], the bound and the ratios to it are medians over the seeds.",
        f"lost: a pair was off by more than {WRONG:g} m for more than {FOR:g} s in one go. "
        "nees and nis are means, 1 is right.",
        f"ok: share of the scored time; wrong: share of the whole run in which a pair was ok and "
        f"off by more than {LIMIT:g} m and {SIGMAS:g} of its own standard deviations; worst s: the "
        "longest time in one go, of all seeds.",
        "gospa: errors, pairs without an estimate, and pairs that are not there, all in one [m].",
        "us: time of the tracker for a ranging round [us]; compare it only at --jobs 1 on an "
        "idle machine.",
    ]
    if has_paper(result):
        lines += [
            "paper: Armani and Holz, ICRA 2024 [m], measured on hardware; everything else is "
            "simulation. The paper does not say which of the three errors it reports.",
            "paper-ekf, paper-ekf-mds: the paper's algorithm as its text has it.",
        ]
    return lines


def target_rows(result: EvaluateResult) -> list[list[str]]:
    """Return the table of targets, one row per target."""
    return [
        [
            case.case.name,
            case.filter,
            target.figure,
            metres(target.reached),
            metres(target.asked),
            f"{metres(target.limit)} = {NEAR:.2f} x bound" if target.by_bound else "as asked",
            "met" if target.met else "missed",
        ]
        for case in result.cases
        for target in case.targets
    ]


def evaluate_files(result: EvaluateResult) -> dict[str, str | bytes]:
    """Return the files of an evaluation by name."""
    drawn = figures.figures(result)
    page = Page(
        f"Evaluation: {result.suite.title.lower()}",
        f"{len(result.suite.cases)} cases, {result.seeds} seeds, {result.seconds:g} s each",
    )
    page.heading("Errors")
    page.table(header(result), rows(result))
    for line in notes(result):
        page.text(line)
    targets = target_rows(result)
    if targets:
        page.heading("Targets")
        page.table(TARGETS, targets)
        page.text(
            f"Where the bound itself lies above what is asked, the target is {NEAR:.2f} times the "
            f"bound. They are meant for {result.suite.seeds} seeds of {result.suite.seconds:g} s."
        )
    page.heading("Cases")
    page.table(["case", "what is special"], [[c.name, c.about] for c in result.suite.cases])
    for name, (title, figure, caption) in drawn.items():
        page.heading(title)
        page.figure(figure, f"{caption} ({name})")
    lines = [*result.records, *result.run_records]
    return {
        "report.html": page.render(),
        "results.jsonl": "".join(json.dumps(r, allow_nan=False) + "\n" for r in lines),
        **{name: svg(figure) for name, (_, figure, _) in drawn.items()},
    }


def _number(value: float | None) -> str:
    """Format a number of about 1 for a table, or a dash."""
    if value is None:
        return "-"
    return f"{value:.2f}" if value < 100.0 else f"{value:.0f}"
