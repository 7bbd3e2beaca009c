"""The option `--scenario`, the same for all commands: it lists what comes with the package."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

Command = Callable[..., Any]


def shipped_names() -> list[str]:
    """Names of the scenarios of the package; nothing of it is imported, so that help is quick."""
    spec = find_spec("relpos_env")
    assert spec is not None
    assert spec.origin is not None
    files = Path(spec.origin).parent / "scenarios" / "files"
    return sorted(path.stem for path in files.glob("*.toml"))


def scenario_option(
    more: str, *names: str, default: str | None = None, multiple: bool = False
) -> Callable[[Command], Command]:
    """The option of a command.

    Args:
        more: What else its help says.
        names: Of the option, by default that alone.
        default: A scenario; None where it follows from something else.
        multiple: May be given several times.
    """
    return click.option(
        "--scenario",
        *names,
        default=default,
        show_default=default is not None,
        multiple=multiple,
        help=f"{', '.join(shipped_names())}, or a TOML file{more}",
    )
