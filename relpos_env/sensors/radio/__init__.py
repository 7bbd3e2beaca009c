"""The air between the nodes: clocks, paths, collisions; see `docs/explanation/simulator.md`."""
