"""Table of the public names of the Python API, from the directives of its page."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tables.markdown import markdown

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "api.md"
NAMED = re.compile(r"^\.\. auto(?:class|function|exception):: ([\w.]+)$", re.MULTILINE)


def api() -> str:
    """Return the table of all names of the page with their first sentence."""
    names = NAMED.findall(PAGE.read_text())
    return markdown(("name", "what it is"), [[f"`{n}`", _sentence(*_split(n))] for n in names])


def _split(name: str) -> tuple[Path, str]:
    """Return the file of the module of a name, and the rest of the name."""
    module, _, rest = name.rpartition(".")
    path = ROOT.joinpath(*module.split("."))
    return (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")), rest


def _sentence(file: Path, name: str) -> str:
    """Return the first line of the docstring of a name, which a module may only import or rename.

    Raises:
        LookupError: The file has no such name.
    """
    for node in ast.parse(file.read_text()).body:
        is_own = isinstance(node, ast.ClassDef | ast.FunctionDef)
        if is_own and node.name == name:
            return (ast.get_docstring(node) or "").partition("\n")[0]
        if isinstance(node, ast.Assign) and [name] == [ast.unparse(at) for at in node.targets]:
            return _sentence(file, ast.unparse(node.value))
        if isinstance(node, ast.ImportFrom) and name in {alias.name for alias in node.names}:
            return _sentence(*_split(f"{node.module}.{name}"))
    raise LookupError(f"{file}: no {name}")
