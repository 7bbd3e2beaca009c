"""Commands for real and emulated nodes and cars."""
