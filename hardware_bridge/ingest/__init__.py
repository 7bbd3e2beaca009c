"""Conversion of bytes from ports to measurements of nodes."""
