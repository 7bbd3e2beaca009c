"""Benchmark of cold starts: installing, importing, compiling and running for the first time.

The peer is a second run in the same environment. Environment, byte code and compiled kernels are
new; only the package cache of pip is reused.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from agents.errors import UsageError

SOURCE = Path(__file__).resolve().parents[2]
"""Package to install if it is a source tree."""
COMMANDS = {
    "import relpos_env": "-c 'import relpos_env'",
    "relpos --help": "-m agents.cli.main --help",
    "compile for track": "-m agents.cli.main warmup --json",
    "compile for env": "-m agents.cli.main warmup --for env",
    "simulate a log": "-m agents.cli.main simulate log{n} --seconds 30",
    "relpos track LOG, compiled": "-m agents.cli.main track log1",
    "relpos demo, compiled for env": "-m agents.cli.main demo --out demo{n}",
}
"""Arguments of the Python interpreter by case."""
Tell = Callable[[float], None]


def bench_cold(*, install: bool = False, progress: Tell | None = None) -> list[dict[str, Any]]:
    """Measure the times of first and second runs, and the memory of compilation.

    Args:
        install: Whether to install into a new environment with pip and use it; False uses the
            packages of the current environment.
        progress: Called with the share done, 0 to 1.

    Raises:
        UsageError: There is no source tree, or a step failed; the message has its last line.
    """
    with tempfile.TemporaryDirectory(prefix="relpos-cold-") as folder:
        cold, rows = _Cold(Path(folder)), list[dict[str, Any]]()
        if install:
            rows.append(_row("install", "s", *cold.install()))
        for k, (case, command) in enumerate(COMMANDS.items()):
            (first, said), (second, _) = cold.run(command, 1), cold.run(command, 2)
            rows.append(_row(case, "s", first, second))
            if "--json" in command:
                largest = json.loads(said)["largest_mb"]
                case = f"{case}, memory of the largest process"
                rows.append(_row(case, "MB", largest, cold.loading_mb()))
            if progress is not None:
                progress((k + 1) / len(COMMANDS))
    return rows


class _Cold:
    """Folder with empty caches of byte code and kernels."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._python = folder, sys.executable
        self._env = {
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder / "kernels"),
            "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
        }
        self._env.pop("PYTHONDONTWRITEBYTECODE", None)

    def install(self) -> tuple[float, float]:
        """Install the package into a new environment twice; return both times [s]."""
        if not (SOURCE / "pyproject.toml").is_file():
            raise UsageError(f"--install: expected a source tree with pyproject.toml at {SOURCE}")
        began = time.perf_counter()
        self._run("-m", "venv", str(self._folder / "venv"))
        scripts = "Scripts" if sys.platform == "win32" else "bin"
        self._python = str(self._folder / "venv" / scripts / "python")
        command = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        if (SOURCE / "constraints.txt").is_file():
            command += ["-c", str(SOURCE / "constraints.txt")]
        self._run(*command, str(SOURCE))
        first, began = time.perf_counter() - began, time.perf_counter()
        self._run(*command, str(SOURCE))
        return first, time.perf_counter() - began

    def run(self, command: str, n: int) -> tuple[float, str]:
        """Run a command with ``{n}`` replaced; return its time [s] and standard output."""
        began = time.perf_counter()
        said = self._run(*shlex.split(command.format(n=n)))
        return time.perf_counter() - began, said

    def loading_mb(self) -> float:
        """Return the peak memory of a process that only loads the compiled tracker [MB]."""
        code = (
            "import resource; from agents.warm_up import parts_of;"
            "[part.compile() for part in parts_of('track')];"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
        )
        return float(self._run("-c", code)) / (1e6 if sys.platform == "darwin" else 1e3)

    def _run(self, *arguments: str) -> str:
        done = subprocess.run(
            [self._python, *arguments],
            env=self._env, cwd=self._folder, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            words = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
            raise UsageError(f"{' '.join(arguments)} failed: {''.join(words)}")
        return done.stdout


def _row(case: str, unit: str, first: float, second: float) -> dict[str, Any]:
    return {
        "bench": "cold",
        "case": case,
        "value": first,
        "unit": unit,
        "peer": "the same again" if unit == "s" else "one that loads the code",
        "peer_value": second,
        "ratio": second / first,
    }
