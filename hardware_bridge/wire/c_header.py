"""Generator of the C header of the wire format for firmware, from the definition.

    python -m hardware_bridge.wire.c_header --out relpos_wire.h

The parts that depend on the messages are generated; the others are in relpos_wire.h.in.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from hardware_bridge.wire import definition as wire
from hardware_bridge.wire.definition import MESSAGES, Field, Message
from hardware_bridge.wire.layout import CRC_TABLE

TEMPLATE = Path(__file__).with_name("relpos_wire.h.in")
HEADER = Path(__file__).with_name("relpos_wire.h")
"""Generated copy in the package."""


def c_header() -> str:
    """Return the text of the header."""
    with_fields = [message for message in MESSAGES if message.fields]
    parts = {
        "VERSION": str(wire.VERSION),
        "HOST": str(wire.HOST),
        "MOST_ROWS": str(wire.MOST_ROWS),
        "MOST_FRAME": str(wire.MOST_FRAME),
        "HEADER_BYTES": str(wire.HEADER_BYTES),
        "FLAG_MAC": str(wire.FLAG_MAC),
        "MESSAGES": "".join(map(_types, MESSAGES)),
        "UNION": "".join(f"        relpos_{m.name} {m.name};\n" for m in with_fields),
        "CRC_TABLE": _crc_table(),
        "CODE": "".join(_code(message) for message in with_fields),
        "PACK": "".join(map(_pack_case, MESSAGES)),
        "UNPACK": "".join(map(_unpack_case, MESSAGES)),
    }
    text = TEMPLATE.read_text()
    for name, part in parts.items():
        text = text.replace(f"@{name}@", part)
    return text


def _c_type(field: Field) -> str:
    bits = {1: 8, 2: 16, 3: 32, 4: 32}[field.size]
    return f"{'' if field.type[0] == 'i' else 'u'}int{bits}_t"


def _types(message: Message) -> str:
    """Return number, struct and bit names of a message."""
    upper = f"RELPOS_{message.name.upper()}"
    lines = [f"/* {message.meaning} */", f"#define {upper} {message.type}u"]
    lines += [
        f"#define {upper}_{field.name.upper()}_{bit.upper()} {1 << k}u"
        for field in message.fields
        for k, bit in enumerate(field.bits)
    ]
    if message.fields:
        lines += ["typedef struct {", *map(_member, message.fields), f"}} {_struct(message)};"]
    if message.repeated:
        row = f"    {_struct(message)} row[RELPOS_MOST_ROWS];"
        lines += ["typedef struct {", "    uint8_t n;", row, f"}} relpos_{message.name};"]
    return "\n".join(lines) + "\n\n"


def _struct(message: Message) -> str:
    return f"relpos_{message.name}{'_row' if message.repeated else ''}"


def _member(field: Field) -> str:
    many = f"[{field.n}]" if field.n > 1 else ""
    meaning = field.meaning
    if field.steps > 1:
        meaning = f"[1/{field.steps} {field.unit}] {meaning}".replace(" ]", "]")
    return f"    {_c_type(field)} {field.name}{many}; /* {meaning} */"


def _places(message: Message) -> Iterator[tuple[Field, str, int]]:
    """Yield field, name in the struct and byte offset of every number of a row."""
    at = 0
    for field in message.fields:
        for k in range(field.n):
            yield field, f"{field.name}[{k}]" if field.n > 1 else field.name, at
            at += field.size


def _code(message: Message) -> str:
    """Return functions that write and read a row, and those that scale its fields."""
    struct, size = _struct(message), message.size
    puts = [
        f"    relpos_put(out + {at}, (uint32_t)m->{name}, {field.size});\n"
        for field, name, at in _places(message)
    ]
    gets = [
        f"    m->{name} = ({_c_type(field)})relpos_get{'_signed' * (field.type[0] == 'i')}"
        f"(in + {at}, {field.size});\n"
        for field, name, at in _places(message)
    ]
    text = f"#define {struct.upper()}_BYTES {size}u\n"
    text += f"static inline void {struct}_put(const {struct} *m, uint8_t *out) {{\n"
    text += "".join(puts) + "}\n"
    text += f"static inline void {struct}_get({struct} *m, const uint8_t *in) {{\n"
    text += "".join(gets) + "}\n"
    text += "".join(_scaled(struct, field) for field in message.fields if field.steps > 1)
    return text + "\n"


def _scaled(struct: str, field: Field) -> str:
    """Return functions that set and read a field in its unit."""
    index, place = ("size_t k, ", "[k]") if field.n > 1 else ("", "")
    low, high = field.limits
    least = f"-{-low - 1} - 1" if low < 0 else str(low)
    many = ", size_t k" if field.n > 1 else ""
    return f"""/* [{field.unit or "-"}]; 0 and nothing is set if the value is not finite. */
static inline int {struct}_set_{field.name}({struct} *m, {index}float value) {{
    int32_t number;
    if (!relpos_scale(value, {field.steps}.0f, {least}, {high}, &number)) return 0;
    m->{field.name}{place} = ({_c_type(field)})number;
    return 1;
}}
static inline float {struct}_{field.name}(const {struct} *m{many}) {{
    return (float)m->{field.name}{place} / {field.steps}.0f;
}}
"""


def _pack_case(message: Message) -> str:
    case = f"    case RELPOS_{message.name.upper()}:\n"
    if not message.fields:
        return f"{case}        return 0;\n"
    one, struct = f"f->of.{message.name}", _struct(message)
    if not message.repeated:
        return f"{case}        {struct}_put(&{one}, out);\n        return {message.size};\n"
    return f"""{case}        if ({one}.n > RELPOS_MOST_ROWS) return -1;
        out[0] = {one}.n;
        for (size_t k = 0; k < {one}.n; k++)
            {struct}_put(&{one}.row[k], out + 1 + {message.size} * k);
        return 1 + {message.size} * {one}.n;
"""


def _unpack_case(message: Message) -> str:
    case = f"    case RELPOS_{message.name.upper()}:\n"
    if not message.fields:
        return f"{case}        return n == 0;\n"
    one, struct = f"f->of.{message.name}", _struct(message)
    if not message.repeated:
        return f"""{case}        if (n != {message.size}) return 0;
        {struct}_get(&{one}, in);
        return 1;
"""
    return f"""{case}        if (n < 1 || in[0] > RELPOS_MOST_ROWS) return 0;
        if (n != 1 + {message.size} * (size_t)in[0]) return 0;
        {one}.n = in[0];
        for (size_t k = 0; k < {one}.n; k++)
            {struct}_get(&{one}.row[k], in + 1 + {message.size} * k);
        return 1;
"""


def _crc_table() -> str:
    """Return the table of four-bit remainders: every 16th entry of the byte table."""
    row = [f"0x{int(CRC_TABLE[0, 16 * k]):08x}u" for k in range(16)]
    lines = [", ".join(row[k : k + 4]) for k in range(0, 16, 4)]
    return "".join(f"        {line},\n" for line in lines)


def main() -> None:
    """Write the header."""
    parser = argparse.ArgumentParser(
        prog="python -m hardware_bridge.wire.c_header", description="Write relpos_wire.h."
    )
    parser.add_argument("--out", type=Path, help="A file; default: standard output.")
    out = parser.parse_args().out
    if out is None:
        sys.stdout.write(c_header())
        return
    try:
        out.write_text(c_header())
    except OSError as error:
        parser.error(f"--out: {error}")


if __name__ == "__main__":
    main()
