"""Tables of the speed of environments, from `relpos bench env --json`."""

from __future__ import annotations

from typing import Any

from tables.markdown import markdown
from tables.measured import measured

CURVES = {"environments": ("growth, ring-los", "envs"), "cars": ("growth, open", "cars")}
"""Rows of each curve, and the key that grows."""


def speeds() -> str:
    """Return the table of env-steps a second next to the peers."""
    head = ("", "envs", "cores", "env-steps/s", "us", "peer", "ratio", "sub-steps by the solver")
    rows = []
    for r in _rows():
        if r["peer"] is None:
            continue
        by_solver = f"{100.0 * r['solver_share']:.0f} %" if "solver_share" in r else ""
        cores = r["threads"] * r["processes"]
        rows.append([
            r["what"], f"{r['envs']}", f"{cores}", f"{r['env_steps_per_s']:.0f}",
            f"{r['us_per_env_step']:.0f}", r["peer"], f"{r['ratio']:.2f}", by_solver,
        ])  # fmt: skip
    return markdown(
        head, rows, right="envs, cores, env-steps/s, us, ratio, sub-steps by the solver"
    )


def parts() -> str:
    """Return the table of the parts of a step."""
    cost: dict[str, dict[str, float]] = {}
    for r in _rows():
        what, _, part = r["what"].partition(": ")
        if part:
            cost.setdefault(part, {})[what] = r["us_per_env_step"]
    drives = list(next(iter(cost.values())))
    rows = [[part, *(f"{of[drive]:.1f}" for drive in drives)] for part, of in cost.items()]
    return markdown(("", *drives), rows, right="rest")


def growth(name: str) -> str:
    """Return the table of one of `CURVES`."""
    what, key = CURVES[name]
    found = [r for r in _rows() if r["what"] == what]
    head = (name, *(f"{r[key]}" for r in found))
    row = ["us", *(f"{r['us_per_env_step']:.0f}" for r in found)]
    return markdown(head, [row], right="rest")


def _rows() -> list[dict[str, Any]]:
    return measured("env-speed")
