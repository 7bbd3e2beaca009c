"""Compile one part in this process: `python -m agents.warm_up NAME`."""

import sys

from agents.warm_up.parts import ORIENTATION, OTHER_PARTS, parts_of
from tracking.filters import DEFAULT_FILTER


def main(name: str) -> None:
    """Compile the part of that name."""
    if name in OTHER_PARTS:
        OTHER_PARTS[name].compile()
        return
    filters = (DEFAULT_FILTER if name == ORIENTATION else name.rpartition(".")[0],)
    found = {part.name: part for part in parts_of("track", filters)}
    found[name].compile()


main(sys.argv[1])
