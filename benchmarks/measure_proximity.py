"""Effect of distance sensors on consensus, for the table of `docs/reference/controllers.md`.

Run `python benchmarks/measure_proximity.py`; some minutes.
"""

from __future__ import annotations

import runpy
from itertools import product
from pathlib import Path

MEASURE = runpy.run_path(str(Path(__file__).parent / "measure_controllers.py"))["measure"]
RUNS = (
    ("hold", "ring-nlos"), ("hold", "cars-nlos"), ("travel", "hall"), ("follow", "hall"),
)  # fmt: skip
NUMBERS = (0, 8, 16)
SEEDS = (range(16), range(100, 132))


def main() -> None:
    """Print the rows of the table."""
    for seeds, n_rangefinders in product(SEEDS, NUMBERS):
        cells = []
        for task, scenario in RUNS:
            error, cars, others = MEASURE(
                "consensus", task, scenario, "estimate", n_rangefinders, seeds
            )
            cells.append(f"{error:.3f} ({cars:.1f}, {others:.1f})")
        print(f"| {seeds[0]} to {seeds[-1]} | {n_rangefinders} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
