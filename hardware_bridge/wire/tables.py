"""Tables of docs/reference/wire-format.md, from the definition of the format."""

from __future__ import annotations

from typing import TypeAlias

from hardware_bridge.wire.definition import HEADER, MESSAGES, MOST_ROWS, Field

Table: TypeAlias = tuple[tuple[str, ...], list[list[str]]]
"""Names of the columns, and rows of cells."""


def header_table() -> Table:
    """Return the table of the frame header."""
    rows, at = [], 0
    for field in HEADER:
        unit = f" [{field.unit}]" if field.unit else ""
        rows.append([str(at), field.type, f"`{field.name}`", field.meaning + unit])
        at += field.size
    return ("offset", "type", "field", "meaning"), rows


def message_table() -> Table:
    """Return the table of all messages with their fields."""
    rows = []
    for message in MESSAGES:
        size = f"{message.size} bytes"
        if message.repeated:
            size = f"1 + {message.size} k bytes, k up to {MOST_ROWS} rows"
        rows.append(
            [str(message.type), f"**`{message.name}`**", "", "", f"{message.meaning}; {size}"]
        )
        if message.repeated:
            rows.append(["", "", "u8", "", "k; then of each row"])
        rows += [
            ["", f"`{field.name}`", _type(field), _step(field), _meaning(field)]
            for field in message.fields
        ]
    return ("type", "name", "number", "step", "meaning"), rows


def _type(field: Field) -> str:
    return field.type + (f" x {field.n}" if field.n > 1 else "")


def _step(field: Field) -> str:
    if field.steps == 1:
        return field.unit
    step = (
        f"{1.0 / field.steps:g}".replace("e-0", "e-")
        if field.steps % 10 == 0
        else f"1/{field.steps}"
    )
    return f"{step} {field.unit}".strip()


def _meaning(field: Field) -> str:
    bits = ", ".join(f"bit {k} `{name}`" for k, name in enumerate(field.bits))
    return f"{field.meaning} ({bits})" if bits else field.meaning
