"""Update of the results in the model cards of the shipped policies.

Run `relpos compare` for each policy, then `python benchmarks/write_cards.py RESULTS ...` with the
results.jsonl of all comparisons. Policies without results keep their cards.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

from agents.policies import load_policy
from agents.policies.find import SHIPPED, shipped_names
from agents.policies.write import write_policy


def main(files: list[Path]) -> None:
    """Write the model cards and print their names."""
    rows = [json.loads(line) for file in files for line in file.read_text().splitlines()]
    for name in shipped_names():
        # Lines of single episodes have no number of episodes.
        found = tuple(row for row in rows if row["policy"] == name and "episodes" in row)
        if found:
            card = replace(load_policy(name).card, results=found)
            write_policy(SHIPPED, name, (SHIPPED / f"{name}.onnx").read_bytes(), card)
            print(f"{name}: {len(found)} results")


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
