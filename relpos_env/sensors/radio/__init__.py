"""The air between the nodes: clocks, paths, collisions; `docs/simulator.md` tells what it does."""
