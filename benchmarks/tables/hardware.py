"""Tables of drivers, decoders, the wire format and the safety gate."""

from __future__ import annotations

import inspect
from dataclasses import fields

from hardware_bridge.decoders import DECODERS
from hardware_bridge.drivers import DRIVERS
from hardware_bridge.safety.params import SafetyParams
from hardware_bridge.safety.rules import RULES
from tables.markdown import default_of, docstrings, markdown


def driver(name: str) -> str:
    """Return the table of the options of a motor driver."""
    options = DRIVERS[name].options
    meanings = docstrings(options)
    rows = [[f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]] for f in fields(options)]
    return markdown(("option", "default", "meaning"), rows)


def decoders() -> str:
    """Return the table of the supported device formats."""
    rows = []
    for name, entry in DECODERS.items():
        tells = ", ".join(kind.__name__.removesuffix("Reading").lower() for kind in entry.tells)
        who = "itself" if entry.names_itself else "`node` of the link"
        when = "its clock" if entry.has_time else "on arrival"
        check = "with a key" if entry.keyed else "yes" if entry.checked else "no"
        rows.append([f"`{name}`", entry.device, tells, who, when, str(entry.baud), check])
    head = ("format", "device", "tells", "sender", "time", "baud", "check sum")
    return markdown(head, rows, right="baud")


def safety_rules() -> str:
    """Return the table of the rules of the safety gate, in order of reporting."""
    rows = []
    for rule in RULES:
        does = inspect.getdoc(rule.check) or ""
        rows.append([f"`{rule.name}`", does.partition("\n")[0], rule.effect, rule.meaning])
    return markdown(("rule", "when", "then", "message"), rows)


def safety_limits() -> str:
    """Return the table of the limits of the safety gate."""
    meanings = docstrings(SafetyParams)
    rows = [[f"`{f.name}`", f"`{default_of(f)}`", meanings[f.name]] for f in fields(SafetyParams)]
    return markdown(("limit", "default", "meaning"), rows)
