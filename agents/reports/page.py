"""A self-contained HTML page of headings, text, tables, figures and animations."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

from agents.reports.style import svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = """
:root { --ink: #1c2430; --soft: #667085; --line: #e4e7ec; --accent: #2563eb; }
* { box-sizing: border-box; }
body { font: 15px/1.55 system-ui, sans-serif; color: var(--ink); background: #f7f8fa; margin: 0; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; } h2 { font-size: 19px; margin: 36px 0 8px; }
p { max-width: 75ch; } .lead { color: var(--soft); margin-top: 0; }
section { background: #fff; border: 1px solid var(--line); border-radius: 10px;
          padding: 18px 20px; margin: 14px 0; overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 5px 14px 5px 0; text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; } th { color: var(--soft); font-weight: 600; }
img, canvas { max-width: 100%; height: auto; display: block; margin: 0 auto; }
.bar { display: flex; gap: 10px; align-items: center; margin-top: 10px; }
.bar input { flex: 1; } button { font: inherit; padding: 3px 12px; border: 1px solid var(--line);
          border-radius: 6px; background: #fff; cursor: pointer; }
.key { color: var(--soft); font-size: 13px; margin: 8px 0 0; }
"""


class Page:
    """A page that is built from top to bottom."""

    def __init__(self, title: str, lead: str) -> None:
        self._title = title
        self._parts = [f"<h1>{html.escape(title)}</h1><p class='lead'>{html.escape(lead)}</p>"]

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Add a table of text cells."""
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
            for row in rows
        )
        self._parts.append(f"<section><table><tr>{head}</tr>{body}</table></section>")

    def figure(self, figure: Figure, caption: str) -> None:
        """Add a matplotlib figure as an embedded SVG."""
        data = base64.b64encode(svg(figure)).decode()
        key = f"<p class='key'>{html.escape(caption)}</p>"
        alt = html.escape(caption, quote=True)
        self._parts.append(
            f"<section><img alt='{alt}' src='data:image/svg+xml;base64,{data}'>{key}</section>"
        )

    def raw(self, markup: str) -> None:
        """Add markup without escaping; only for markup generated in this package."""
        self._parts.append(f"<section>{markup}</section>")

    def render(self) -> str:
        """Return the page as HTML."""
        body = "\n".join(self._parts)
        return (
            "<!doctype html><html lang='en'><head><meta charset='utf-8'>"
            "<meta name='viewport' content='width=device-width, initial-scale=1'>"
            f"<title>{html.escape(self._title)}</title><style>{_STYLE}</style></head>"
            f"<body><main>{body}</main></body></html>\n"
        )


def percent(share: float | None, digits: int = 0) -> str:
    """Format a share in percent, or a dash."""
    return "-" if share is None else f"{100.0 * share:.{digits}f} %"


def metres(value: float | None) -> str:
    """Format a length [m] for a table, or a dash."""
    return "-" if value is None or value != value else f"{value:.3f}"
