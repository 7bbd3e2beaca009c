"""Experiments with the ranging protocol: `relpos protocol`."""
