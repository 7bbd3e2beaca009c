"""Radio simulation: clocks, paths, collisions; see `docs/explanation/simulator.md`."""
