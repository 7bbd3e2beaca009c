"""Live streams into trackers: pure, so that a recording reproduces the run."""
