"""In-process command line for tests: output and exit status, with imports done once."""

import contextlib
import io
import sys
import traceback
from dataclasses import dataclass
from unittest import mock

from agents.cli.main import main


@dataclass(frozen=True)
class Done:
    """Output and exit status of a command."""

    returncode: int
    stdout: str
    stderr: str


def relpos(*args, cwd="."):
    """Run ``relpos ARGS`` in a folder, as `agents.cli.main.main` in a process of its own would."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        mock.patch.object(sys, "argv", ["relpos", *map(str, args)]),
        contextlib.chdir(cwd),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as error:
            code = int(error.code or 0)
        except Exception:
            traceback.print_exc()
            code = 1
    return Done(code, out.getvalue(), err.getvalue())
