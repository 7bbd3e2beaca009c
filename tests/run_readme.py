"""Run the code of README.md in order, in an empty folder, as a reader who copies it.

python tests/run_readme.py BIN    BIN is the folder of the programs of an installed relpos-env.

Lines that make the environment and install are left out: `make dist` has done both. Kernels that
this checkout has compiled serve the installation as well, which saves minutes.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
PACKAGES = ("tracking", "relpos_env", "agents", "hardware_bridge")
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)
INSTALLS = re.compile(r"^(python3 -m venv|pip install)")
LONGEST = 600.0
"""[s] Time that one block may take."""


def main(programs: Path) -> int:
    """Run all blocks; return the exit status of the first that fails, or 0."""
    take_kernels(programs)
    blocks = BLOCK.findall(README.read_text())
    if len(blocks) < 4:
        print(f"expected four blocks of code and more, found {len(blocks)}")
        return 1
    path = f"{programs.resolve()}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as folder:
        for language, code in blocks:
            lines = [line for line in code.splitlines() if not INSTALLS.match(line)]
            text = "\n".join(lines)
            # What a block leaves in the background ends with it.
            shell = ["bash", "-ec", f"trap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n{text}"]
            began = time.monotonic()
            done = subprocess.run(
                shell if language == "sh" else ["python", "-c", text],
                cwd=folder, env={**os.environ, "PATH": path}, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=LONGEST,
                check=False,
            )  # fmt: skip
            first = lines[0] if lines else "(installation)"
            print(f"{time.monotonic() - began:5.0f} s  {first}", flush=True)
            if done.returncode != 0:
                print(f"{text}\n{done.stdout}\nfailed with status {done.returncode}")
                return 1
    return 0


def take_kernels(programs: Path) -> None:
    """Copy compiled kernels to the installation, which finds them by a hash of their sources."""
    (site,) = programs.resolve().parent.glob("lib/python3*/site-packages")
    for package in PACKAGES:
        for file in (ROOT / package).rglob("__pycache__/*.nb[ic]"):
            target = site / file.relative_to(ROOT)
            target.parent.mkdir(exist_ok=True)
            shutil.copy(file, target)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
