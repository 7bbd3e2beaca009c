"""Scenario files: those of the package by name, and those of users by path."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from relpos_env.errors import EnvError
from relpos_env.registry import look_up
from relpos_env.scenarios.base import Scenario
from relpos_env.scenarios.levels import level
from relpos_env.scenarios.randomisation import Randomisation
from relpos_env.scenarios.rooms.floor_plan import read_floor_plan
from relpos_env.scenarios.rooms.gap import Gap
from relpos_env.sensors.radio.channel import CHANNELS, ChannelParams
from tracking.params.tables import Preset, TableReader, Where
from tracking.ranging.frames.airtime import PHYS, Phy

FILES = Path(__file__).parent / "files"
SUFFIX = ".toml"
DEEPEST = 8
"""[-] Maximum depth of files that extend each other."""


class Catalogue(Mapping[str, Scenario]):
    """Scenarios of the package; each file is read at its first use."""

    def __init__(self) -> None:
        self._names = sorted(path.stem for path in FILES.glob(f"*{SUFFIX}"))

    def __getitem__(self, name: str) -> Scenario:
        if name not in self._names:
            raise KeyError(name)
        return shipped(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names


def is_path(name_or_path: str | Path) -> bool:
    """Return whether a scenario is given by the path of a file instead of a name."""
    return isinstance(name_or_path, Path) or name_or_path.endswith(SUFFIX)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario from a TOML file, see `docs/reference/scenarios.md`.

    Raises:
        EnvError: No such file, invalid TOML, or an unknown key or invalid value; names the file
            and the key.
    """
    return _load(Path(path), 0)


@cache
def shipped(name: str) -> Scenario:
    """Return a scenario of the package."""
    return load_scenario(FILES / f"{name}{SUFFIX}")


def scenario_from(
    table: Mapping[str, Any], *, file: str, name: str, folder: Path | None = None, depth: int = 0
) -> Scenario:
    """Return the scenario of a parsed file.

    Args:
        table: Parsed TOML.
        file: Name of the file in errors.
        name: Default name of the scenario.
        folder: Folder of files named in the table; None is the working directory.
        depth: Number of files that extend this one, directly or indirectly.

    Raises:
        EnvError: Invalid content; names the file and the key.
    """
    where, rest = Where(file, raises=EnvError), dict(table)
    inherited: list[Gap | None] = []

    def parent(name_or_path: str) -> Scenario:
        if not is_path(name_or_path):
            base = look_up(SHIPPED, name_or_path, "extends")
        elif depth < DEEPEST:
            base = _load(_within(folder, name_or_path, ""), depth + 1)
        else:
            raise EnvError(f"expected files that extend each other at most {DEEPEST} deep")
        inherited.append(base.gap)
        return base.with_gap(None)  # its wall need not fit another room

    rest.setdefault("name", name)
    furnish, plan = rest.pop("furnish", None), rest.pop("floor_plan", None)
    reader = TableReader(presets={**_PRESETS, Scenario: Preset("extends", str, parent)})
    gap_table = rest.pop("gap", None)
    read = reader.read(Scenario, rest, where)
    try:
        if furnish is not None:
            read = replace(read, furnish=look_up({}, furnish, "furnish", group="relpos_env.worlds"))
        if plan is not None:
            walls = read_floor_plan(_within(folder, str(plan), "floor_plan: "))
            read = replace(read, obstacles=read.obstacles + walls)
    except EnvError as error:
        raise where.error(str(error)) from error
    gap = next(iter(inherited), None)
    if gap_table is not None:
        gap = reader.read(Gap, gap_table, where.key("gap"), gap)
    try:
        return read if gap is None else read.with_gap(gap)
    except EnvError as error:
        raise where.error(str(error)) from error


def _within(folder: Path | None, relative: str, key: str) -> Path:
    """Return the path of a file that a scenario names; only its own folder is permitted.

    Args:
        folder: Folder of the scenario; files may be below it.
        relative: Path in the scenario.
        key: Prefix of error messages.

    Raises:
        EnvError: The path is outside of the folder (scenarios are shared), or invalid.
    """
    folder = folder or Path()
    path = folder / relative
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
    except (ValueError, RuntimeError, OSError):  # a null byte, a loop of symbolic links
        inside = False
    if not inside or path.is_dir():
        raise EnvError(f"{key}expected a file in the folder of the scenario, got {relative!r}")
    return path


def _load(path: Path, depth: int) -> Scenario:
    if path.exists() and not path.is_file():
        raise EnvError(f"scenario: expected a file, got {str(path)!r}")
    try:
        with path.open("rb") as stream:
            table = tomllib.load(stream)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise EnvError(f"scenario: cannot read {str(path)!r}: {reason}") from error
    except (ValueError, RecursionError) as error:  # invalid TOML or UTF-8, or nested too deeply
        raise EnvError(f"{path.name}: expected TOML: {error}") from error
    return scenario_from(table, file=path.name, name=path.stem, folder=path.parent, depth=depth)


SHIPPED = Catalogue()
_PRESETS: dict[type, Preset] = {
    ChannelParams: Preset("place", str, lambda name: look_up(CHANNELS, name, "place")),
    Phy: Preset("setting", str, lambda name: look_up(PHYS, name, "setting")),
    Randomisation: Preset("level", object, level),
}
