"""Checked access to tables and ids of swarm.toml."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tracking.constellation import Constellation
from tracking.params.tables import Where

MOST_ID = 65534
"""[-] Largest id of a node; the largest id of our wire format, 65535, is the host."""


def tables_of(raw: Mapping[str, Any], name: str, where: Where) -> list[tuple[str, dict[str, Any]]]:
    """Return the tables of a table of tables."""
    section = raw.get(name, {})
    if not isinstance(section, dict):
        raise where.key(name).error(f"expected tables [{name}.X]")
    for key, table in section.items():
        if not isinstance(table, dict):
            raise where.key(name).key(key).error("expected a table")
    return list(section.items())


def without(table: Any, name: str, where: Where) -> tuple[Any, dict[str, Any]]:
    """Return a table without one of its inner tables, and this inner table."""
    if not isinstance(table, dict):
        return table, {}
    inner = table.get(name, {})
    if not isinstance(inner, dict):
        raise where.key(name).error("expected a table")
    return {k: v for k, v in table.items() if k != name}, inner


def node_id(text: str, where: Where) -> int:
    """Return the id that a key represents."""
    if not (text.isascii() and text.isdigit() and int(text) <= MOST_ID):
        raise where.error(f"expected an id from 0 to {MOST_ID}")
    return int(text)


def check_node(node: Any, group: Constellation, where: Where) -> None:
    """Raise an error if a value is not the id of a node of the group."""
    if isinstance(node, bool) or not isinstance(node, int) or node not in group.index_of:
        ids = ", ".join(map(str, group.ids))
        raise where.error(f"expected a node of this file ({ids}), got {node!r}")
