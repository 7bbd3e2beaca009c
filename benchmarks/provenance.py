"""Provenance of results and figures, and detection of those older than their code.

`results/provenance.json` has an entry for every file of results, every figure of the documents and
every model card: the command that made it, version, commit, date and machine, and a hash of the
code that it depends on. Run `python benchmarks/provenance.py` to list stale files, with
`--stamp FILE ...` after files have been regenerated.
"""

from __future__ import annotations

import ast
import hashlib
import json
import platform
import subprocess
import sys
from datetime import date
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "benchmarks" / "results" / "provenance.json"

Entry = dict[str, Any]


def load() -> dict[str, Entry]:
    """Return the entries by path from the top folder."""
    found: dict[str, Entry] = json.loads(RECORD.read_text())
    return found


def code_hash(sources: list[str], root: Path = ROOT) -> str:
    """Return a hash of the code of some files and folders, without comments."""
    digest = hashlib.sha256()
    for source in sources:
        path = root / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.relative_to(root).as_posix().encode())
            digest.update(_code(file.read_text(encoding="utf-8")).encode())
    return digest.hexdigest()[:16]


@cache
def _code(text: str) -> str:
    """Return Python code without comments and docstrings, which do not affect results."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # type: ignore[attr-defined]
                s for s in body
                if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))
            ]  # fmt: skip
    return ast.dump(tree)


def stale(entries: dict[str, Entry], root: Path = ROOT) -> list[str]:
    """Return the files whose code has changed since they were made."""
    return [name for name, e in entries.items() if e["code"] != code_hash(e["sources"], root)]


def stamp(entries: dict[str, Entry], names: list[str]) -> None:
    """Record that files were made with the current code.

    Raises:
        KeyError: A file has no entry: add one with its command and sources.
    """
    commit = subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], text=True, cwd=ROOT)
    for name in names:
        entries[name] |= {
            "version": version("relpos-env"),
            "commit": commit.strip(),
            "date": date.today().isoformat(),
            "machine": f"{platform.machine()}, Python {platform.python_version()}",
            "code": code_hash(entries[name]["sources"]),
        }
    RECORD.write_text(json.dumps(entries, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    known = load()
    if sys.argv[1:2] == ["--stamp"]:
        stamp(known, sys.argv[2:])
    for path in stale(known):
        print(f"{path}: code has changed since {known[path].get('date')}: {known[path]['command']}")
