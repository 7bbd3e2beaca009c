"""Words to avoid in plain technical English; their number may only fall.

`make check` runs it. `tests/words.toml` has the words, the terms to use, and the limits of
occurrences; `python tests/words.py --lower` lowers the limits to the present numbers.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FILE = Path(__file__).with_name("words.toml")
LEFT_OUT = ("tests/", "docs/development/", "CHANGELOG.md")
"""History may use the words of its time."""
ENDINGS = (".py", ".md", ".toml", ".h", ".in")


def texts(root: Path = ROOT) -> dict[str, str]:
    """Return the texts of the repository by path."""
    names = subprocess.check_output(["git", "ls-files"], text=True, cwd=root).splitlines()
    return {
        name: (root / name).read_text(encoding="utf-8")
        for name in names
        if name.endswith(ENDINGS) and not name.startswith(LEFT_OUT) and (root / name).exists()
    }


def count(word: str, found: dict[str, str]) -> list[str]:
    """Return where a word occurs, as ``path:line``."""
    pattern = re.compile(rf"\b(?:{word})\b", re.IGNORECASE)
    return [
        f"{name}:{k}"
        for name, text in found.items()
        for k, line in enumerate(text.splitlines(), 1)
        for _ in pattern.findall(line)
    ]


def main() -> int:
    """Compare with the limits; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lower", action="store_true", help="Lower the limits to what is found.")
    lower = parser.parse_args().lower
    limits = tomllib.loads(FILE.read_text(encoding="utf-8"))
    found, failed, lines = texts(), False, []
    for word, entry in limits.items():
        places = count(word, found)
        if len(places) > entry["most"]:
            failed = True
            print(f"{word!r}: {len(places)} times, at most {entry['most']}; use {entry['use']}")
            print("  " + " ".join(places[-10:]))
        most = min(entry["most"], len(places))
        lines.append(
            f'"{word}" = {{ use = "{entry["use"]}", most = {most} }}'.replace("\\", "\\\\")
        )
    if lower:
        FILE.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
