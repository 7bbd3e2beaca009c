"""Draw docs/images/architecture.svg from docs/images/architecture.txt."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
WIDE, HIGH, GAP = 1.75, 1.05, 0.5


def main() -> None:
    """Read boxes and arrows and draw them."""
    mpl.rcParams["svg.hashsalt"] = "architecture"
    boxes: dict[str, tuple[float, float, float]] = {}
    fig, ax = plt.subplots(figsize=(13.5, 4.6))
    for line in (IMAGES / "architecture.txt").read_text().splitlines():
        if line.startswith("#") or not line.strip():
            continue
        head, *parts = (part.strip() for part in line.split("|"))
        kind, *names = head.split()
        if kind == "box":
            column, row, width = map(float, parts[0].split())
            x, y, w = column * WIDE, -row * (HIGH + GAP), width * WIDE
            boxes[names[0]] = (x, y, w)
            ax.add_patch(plt.Rectangle((x, y), w, HIGH, fc="#eef3f8", ec="#33536f", lw=1.2))
            text = "\n".join(parts[1:])
            ax.text(x + w / 2, y + HIGH / 2, text, ha="center", va="center", fontsize=8)
        else:
            _arrow(ax, boxes[names[0]], boxes[names[1]], parts[0])
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.axis("off")
    fig.savefig(IMAGES / "architecture.svg", bbox_inches="tight", metadata={"Date": None})


def _arrow(
    ax: plt.Axes, of: tuple[float, float, float], to: tuple[float, float, float], label: str
) -> None:
    (x0, y0, w0), (x1, y1, w1) = of, to
    if x0 == x1:  # one above the other
        down = y1 < y0
        start = (x0 + w0 / 2, y0 if down else y0 + HIGH)
        end = (x1 + w1 / 2, y1 + HIGH if down else y1)
        place, align = (start[0] + 0.08, (start[1] + end[1]) / 2), "left"
    else:
        start, end = (x0 + w0, y0 + HIGH / 2), (x1, y1 + HIGH / 2)
        place, align = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 + 0.13), "center"
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": "#33536f", "lw": 1.2})
    ax.text(*place, label, fontsize=7.5, color="#33536f", ha=align, va="center")


if __name__ == "__main__":
    main()
