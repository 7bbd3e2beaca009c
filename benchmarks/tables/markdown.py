"""Tables in Markdown, and the texts of classes that are their cells."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable
from dataclasses import MISSING, Field
from typing import Any


def markdown(head: Iterable[str], rows: Iterable[Iterable[str]], right: str = "") -> str:
    """Return a Markdown table; `right` names right-aligned columns, "rest" is all but the first."""
    head = list(head)
    named = head[1:] if right == "rest" else right.split(", ")
    rule = ["--:" if name in named else "---" for name in head]
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, *rows)]
    lines.insert(1, "|" + "|".join(rule) + "|")
    return "\n".join(lines) + "\n"


def default_of(f: Field[Any]) -> str:
    """Return the default of a field as Python code."""
    if f.default is not MISSING:
        return repr(f.default)
    assert f.default_factory is not MISSING
    value = f.default_factory()
    return repr(value) if isinstance(value, dict) else f"{type(value).__name__}()"


def docstrings(cls: type) -> dict[str, str]:
    """Return the docstrings of the fields of a dataclass or enum, each in one line."""
    (body,) = ast.parse(inspect.getsource(cls)).body
    assert isinstance(body, ast.ClassDef)
    meanings = {}
    for line, below in zip(body.body, body.body[1:], strict=False):
        if not isinstance(line, ast.Assign | ast.AnnAssign) or not isinstance(below, ast.Expr):
            continue
        target = line.target if isinstance(line, ast.AnnAssign) else line.targets[0]
        if isinstance(target, ast.Name) and isinstance(below.value, ast.Constant):
            meanings[target.id] = " ".join(str(below.value.value).split())
    return meanings
