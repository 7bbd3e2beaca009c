"""Tables of the parameters, states, faults and findings of the tracker."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from tables.markdown import docstrings, markdown
from tracking.filters.joint.hypotheses.alignment import TRANSITIONS, Alignment
from tracking.filters.joint.supervision.faults import CATALOGUE, Fault
from tracking.findings import KINDS


def alignment() -> str:
    """Return the table of the alignment states and their transitions."""
    rows = []
    for state, following in TRANSITIONS.items():
        then = "; ".join(f"{why}: `{after.name}`" for after, why in following.items())
        rows.append([f"`{state.name}`", docstrings(Alignment)[state.name], then])
    return markdown(("state", "what it is", "then"), rows)


def faults() -> str:
    """The catalogue of faults."""
    meaning = docstrings(Fault)
    rows = [
        [f"`{f.name}`", " ".join(meaning[f.name].split()), f"`{r.limit}`", r.decided, r.action]
        for f, r in CATALOGUE.items()
    ]
    return markdown(("fault", "meaning", "limit", "decided", "action"), rows)


def findings() -> str:
    """Return the table of findings in recordings."""
    order = ("error", "warning", "note")
    kinds = sorted(KINDS.items(), key=lambda item: order.index(item[1].severity))
    rows = [[f"`{name}`", kind.severity, kind.meaning, kind.remedy] for name, kind in kinds]
    return markdown(("name", "severity", "meaning", "remedy"), rows)


def parameters(params: Any, names: tuple[str, ...]) -> str:
    """Return the table of the parameters of a stage, those of its parts included."""
    rows = []
    for name in ("", *names):
        part = getattr(params, name) if name else params
        meanings = docstrings(type(part))
        for f in fields(part):
            value = getattr(part, f.name)
            if not is_dataclass(value) and not isinstance(value, dict):
                unit, _, meaning = meanings[f.name].replace("\n", " ").partition("]")
                named = [
                    f"`{name}{'.' * bool(name)}{f.name}`",
                    f"`{value}`" if value in (None, True, False) else f"`{value:g}`",
                    unit.lstrip("["),
                ]
                rows.append([*named, " ".join(meaning.split())])
    return markdown(("parameter", "default", "unit", "meaning"), rows)
