"""Evaluation protocols: files that fix what a comparison measures, so that figures can be cited.

"hard, protocol 1" names the level and the protocol.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from agents.errors import UsageError
from relpos_env.core.tracked_world import Trackers
from tracking.params.tables import TableReader, Where

FOLDER = Path(__file__).parent / "protocols"
SUFFIX = ".toml"


@dataclass(frozen=True, slots=True, kw_only=True)
class Protocol:
    """What is fixed; the fields are arguments of `agents.comparison.compare.compare`."""

    tasks: tuple[str, ...]
    """Tasks, each in its own scenario."""
    observations: tuple[str, ...]
    trackers: Trackers
    operator: float
    """[-] Share of episodes with an operator."""
    episodes: int
    """[-] Episodes of each task."""
    first_seed: int
    seconds: float
    """[s] Length of an episode."""
    settle: float
    """[s] Time from which errors are scored."""


def protocols() -> tuple[str, ...]:
    """Return the names of the protocols of the package."""
    return tuple(sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}")))


def protocol_arguments(name_or_file: str) -> dict[str, Any]:
    """Return the arguments of `compare` that a protocol fixes, its name among them.

    Args:
        name_or_file: One of `protocols`, or a TOML file with the fields of `Protocol`.

    Raises:
        UsageError: There is no such protocol, or a field is missing or wrong.
    """
    names = protocols()
    is_file = name_or_file.endswith(SUFFIX)
    if not is_file and name_or_file not in names:
        known = ", ".join(names)
        raise UsageError(f"--protocol: expected {known} or a file *.toml, got {name_or_file!r}")
    path = Path(name_or_file) if is_file else FOLDER / f"{name_or_file}{SUFFIX}"
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise UsageError(f"--protocol {path}: cannot be read ({error})") from error
    where = Where(path.name, raises=UsageError)
    for field in fields(Protocol):
        if field.name not in table:
            raise where.key(field.name).error("missing")
    read = TableReader().read(Protocol, table, where)
    fixed = {field.name: getattr(read, field.name) for field in fields(Protocol)}
    return {"protocol": path.stem, **fixed}
