"""Live streams into trackers: pure, so that a recording gives what was seen."""
