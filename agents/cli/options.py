"""Options shared by several commands, with the same name, meaning and help."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

Command = Callable[..., Any]


def shipped_names() -> list[str]:
    """Return the names of shipped scenarios without importing the package, for fast help."""
    spec = find_spec("relpos_env")
    assert spec is not None
    assert spec.origin is not None
    files = Path(spec.origin).parent / "scenarios" / "files"
    return sorted(path.stem for path in files.glob("*.toml"))


json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON lines on stdout, nothing else."
)
cars_option = click.option(
    "--cars", type=int, help="Number of cars, 2 to 20.  [default: as many as the scenario has]"
)
trackers_option = click.option(
    "--trackers",
    type=click.Choice(["group", "own"]),
    default="group",
    show_default=True,
    help="group: one tracker receives the samples of all cars; own: one on each car.",
)
task_option = click.option(
    "--task",
    default="ring",
    show_default=True,
    help="Task: ring, hold, travel, gap, rendezvous, follow, observe, escort, seek or inspect.",
)
policy_option = click.option(
    "--policy",
    metavar="NAME_OR_PATH",
    help="Trained policy that drives: a name, a file or a folder; see `relpos policy list`.",
)


def _check_out(context: click.Context, _: click.Parameter, folder: Path | None) -> Path | None:
    """Check that a given folder is new or empty, unless --overwrite is given."""
    from agents.output import check_new

    given = ParameterSource.COMMANDLINE
    is_free = context.get_parameter_source("overwrite") is given
    if folder is not None and context.get_parameter_source("out") is given and not is_free:
        check_new(folder, hint=" or --overwrite")
    return folder


def out_options(
    text: str, *, default: Path | None = None, required: bool = False
) -> Callable[[Command], Command]:
    """Return `--out` for a new or empty folder, and `--overwrite`, which allows any folder.

    Without `--out`, files in the default folder are replaced.

    Args:
        text: Written files, a noun phrase.
        default: Default folder.
        required: Whether `--out` is required.
    """
    # A default of None would count as a given value.
    kept: dict[str, Any] = {"required": required}
    if default is not None:
        kept |= {"default": default, "show_default": True}

    def add(command: Command) -> Command:
        command = click.option(
            "--overwrite",
            is_flag=True,
            is_eager=True,
            expose_value=False,
            help="Replace files of the same names in the folder of --out.",
        )(command)
        return click.option(
            "--out",
            type=Path,
            callback=_check_out,
            help=f"New or empty folder for {text}.",
            **kept,
        )(command)

    return add


def log_out_options(command: Command) -> Command:
    """Add `--out` for a log folder, and `--overwrite`, which replaces a log folder."""
    command = click.option(
        "--overwrite", is_flag=True, is_eager=True, help="Replace the log folder of --out."
    )(command)
    return click.option(
        "--out",
        type=Path,
        required=True,
        callback=_check_out,
        help="New or empty folder for the log.",
    )(command)


def jobs_options(text: str) -> Callable[[Command], Command]:
    """Return the options `--jobs`, `--engine` and `--address`.

    Args:
        text: Sentence about figures that depend on the number of processes.
    """

    def add(command: Command) -> Command:
        for option in (
            click.option(
                "--address",
                help="Address of a running Ray cluster: auto or host:port; needs --engine ray.",
            ),
            click.option(
                "--engine",
                default="local",
                show_default=True,
                help="Engine that runs the jobs: local or ray.",
            ),
            click.option(
                "--jobs", default=1, show_default=True, help=f"Number of processes. {text}"
            ),
        ):
            command = option(command)
        return command

    return add


def scenario_option(
    more: str, *names: str, default: str | None = None, multiple: bool = False
) -> Callable[[Command], Command]:
    """Return the option `--scenario`.

    Args:
        more: Text appended to the help.
        names: Additional names of the option or its parameter.
        default: Default scenario; None if it depends on other options.
        multiple: Whether the option is repeatable.
    """
    return click.option(
        "--scenario",
        *names,
        default=default,
        show_default=default is not None,
        multiple=multiple,
        help=f"{', '.join(shipped_names())}, or a TOML file{more}",
    )
