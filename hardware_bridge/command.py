"""Entry point of `relpos`, outside of `agents` because other distributions use that name too."""

from __future__ import annotations

import sys
from importlib import import_module

TAKEN = """Error: the package `agents` that Python finds is not that of relpos-env but
{path}.
Other distributions (such as openai-agents) install a package of that name too, and a folder
`agents` next to a script hides it. Give relpos-env an environment of its own.
"""


def main() -> None:
    """Run the command line; exit with 2 if another package `agents` shadows it."""
    try:
        command_line = import_module("agents.cli.main")
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "agents":
            raise
        found = sys.modules.get("agents")
        paths = list(getattr(found, "__path__", [])) or ["missing"]
        sys.stderr.write(TAKEN.format(path=paths[0]))
        sys.exit(2)
    command_line.main()
