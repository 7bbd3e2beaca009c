"""Commands and code of the documents match the programs."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from agents.cli.main import cli

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(?:\{code-cell\} )?(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
PLACEHOLDER = re.compile(r"[<>…]|\.\.\.")


def blocks(page, language):
    return [code for kind, code in BLOCK.findall(page.read_text()) if kind == language]


def commands(page):
    """Return command lines of relpos, without shell syntax."""
    for block in blocks(page, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"[;&|]", line.split(" #")[0]):
                words = shlex.split(part)
                if words and words[0].removeprefix(".venv/bin/") == "relpos":
                    yield words[1:]


DOCUMENTED = [(page.name, words) for page in PAGES for words in commands(page)]


def test_there_are_many_commands():
    assert len(DOCUMENTED) > 60


@pytest.mark.parametrize(("page", "words"), DOCUMENTED, ids=lambda v: " ".join(v)[:60])
def test_documented_commands_have_such_options(page, words):
    if PLACEHOLDER.search(" ".join(words)):
        pytest.skip("stands for several commands")
    command = cli
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        name, *words = words
        command = command.commands.get(name)
        assert command is not None, f"{page}: no command {name!r}"
    if words not in (["--help"], ["-h"], ["--version"]):
        command.make_context(command.name, list(words))


@pytest.mark.parametrize("page", ["README.md", "docs/tutorials/environment.md",
                                  "docs/tutorials/tracking.md",
                                  "docs/tutorials/notebook.md",
                                  "docs/tutorials/notebook-sb3.md"])  # fmt: skip
def test_python_of_the_first_pages_runs(page, tmp_path):
    code = "\n".join(blocks(ROOT / page, "python"))
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_first_page_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 110
    assert len((ROOT / "CHANGELOG.md").read_text().splitlines()) <= 40
