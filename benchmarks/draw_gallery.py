"""Draw the animations of docs/reference/gallery.md: every task, and every scenario.

Run `python benchmarks/draw_gallery.py`; about six minutes, needs pygame.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageSequence

from relpos_env.scenarios import SCENARIOS
from relpos_env.tasks import TASKS

OUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "gallery"
SECONDS, SEED = 20.0, 2
ROOM = 0.692
"""[-] Share of the room in the width of a frame; the rest is the legend."""
WIDTH = 280
"""[px] Width of an animation."""
EVERY = 4
"""[-] Every fourth frame is kept."""


def shrink(source: Path, target: Path) -> None:
    """Write a small copy of a drive without its legend."""
    with Image.open(source) as gif:
        frames = []
        for k, frame in enumerate(ImageSequence.Iterator(gif)):
            if k % EVERY == 0:
                width, height = round(frame.width * ROOM), frame.height
                small = frame.convert("RGB").crop((0, 0, width, height))
                frames.append(
                    small.resize((WIDTH, round(WIDTH * height / width)), Image.Resampling.LANCZOS)
                )
                frames[-1] = frames[-1].quantize(64, method=Image.Quantize.FASTOCTREE)
        duration = EVERY * int(gif.info.get("duration", 200))
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=duration, loop=0)


def main() -> None:
    """Run the demonstrations and write their animations."""
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        jobs = [(f"task-{name}", ["--task", name]) for name in TASKS]
        for name in SCENARIOS:
            task = "gap" if name == "gap" else "hold"
            jobs.append((name, ["--scenario", name, "--task", task]))
        for name, how in jobs:
            folder = Path(scratch) / name
            command = [sys.executable, "-m", "agents.cli.main", "demo", "--gif", "--out", folder]
            times = ["--seconds", str(SECONDS), "--seed", str(SEED)]
            subprocess.run([*map(str, command), *times, *how], check=True, capture_output=True)
            shrink(folder / "drive.gif", OUT / f"{name}.gif")
            print(name, file=sys.stderr)


if __name__ == "__main__":
    main()
