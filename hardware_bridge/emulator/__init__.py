"""Emulated nodes and cars behind serial ports."""
