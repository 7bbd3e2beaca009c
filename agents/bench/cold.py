"""How long everything takes the first time: installing, importing, compiling, running.

Each figure stands beside that of the second time, in the same environment. Nothing of this machine
is used but what pip keeps of packages: environment, byte code, and compiled kernels are new.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from agents.errors import UsageError

SOURCE = Path(__file__).resolve().parents[2]
"""What is installed where it is a source tree."""
Tell = Callable[[float], None]


def bench_cold(*, install: bool = False, progress: Tell | None = None) -> list[dict[str, Any]]:
    """Seconds of the first and the second time.

    Args:
        install: Also install into a new environment, from what pip finds, and use that; else the
            packages of this one.
        progress: Called with the share done.

    Raises:
        UsageError: There is nothing to install from, or a step failed; the message has its words.
    """
    with tempfile.TemporaryDirectory(prefix="relpos-cold-") as folder:
        cold = _Cold(Path(folder))
        steps: list[tuple[str, Callable[[], tuple[float, float]]]] = []
        if install:
            steps.append(("install", cold.install))
        for case, *command in (
            ("import relpos_env", "-c", "import relpos_env"),
            ("relpos --help", "-m", "agents.cli", "--help"),
        ):
            steps.append((case, lambda given=tuple(command): cold.twice(*given)))  # type: ignore[misc]
        for case, *command in (
            ("compile for track", "warmup"),
            ("compile for env", "warmup", "--for", "env"),
            ("simulate a log", "simulate", str(Path(folder) / "{n}"), "--seconds", "30"),
            ("relpos track LOG, compiled", "track", str(Path(folder) / "1")),
            ("relpos demo, compiled for env", "demo", "--out", str(Path(folder) / "demo")),
        ):
            given = ("-m", "agents.cli", *command)
            steps.append((case, lambda given=given: cold.twice(*given)))  # type: ignore[misc]
        rows = []
        for k, (case, measure) in enumerate(steps):
            first, second = measure()
            rows.append(_row(case, "s", first, second))
            if progress is not None:
                progress((k + 1) / len(steps))
        rows.append(_row("memory of the largest process that compiles", "MB", *cold.memory()))
    return rows


class _Cold:
    """A place where nothing was done before."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._python = folder, sys.executable
        self._env = {
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder / "kernels"),
            "PYTHONPYCACHEPREFIX": str(folder / "bytecode"),
        }
        self._env.pop("PYTHONDONTWRITEBYTECODE", None)

    def install(self) -> tuple[float, float]:
        """A new environment with the package, and the same once more."""
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

    def twice(self, *arguments: str) -> tuple[float, float]:
        """Time of a command, and of the same again [s]; ``{n}`` in it becomes 1 and 2."""
        times = []
        for n in ("1", "2"):
            began = time.perf_counter()
            self._run(*(argument.replace("{n}", n) for argument in arguments))
            times.append(time.perf_counter() - began)
        return times[0], times[1]

    def memory(self) -> tuple[float, float]:
        """Of the largest process of `relpos warmup`, and of one that only loads its code [MB]."""
        self._env["NUMBA_CACHE_DIR"] = str(self._folder / "kernels-again")
        said = self._run("-m", "agents.cli", "warmup", "--json")
        code = (
            "import resource; from agents.warm_up import parts_of;"
            "[part.compile() for part in parts_of('track')];"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
        )
        scale = 1e6 if sys.platform == "darwin" else 1e3
        return json.loads(said)["largest_mb"], float(self._run("-c", code)) / scale

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
