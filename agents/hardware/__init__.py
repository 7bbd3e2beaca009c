"""Programs for real and emulated nodes and cars."""
