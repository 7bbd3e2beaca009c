"""Strangers' recordings become log folders: what `relpos convert` does, as a function."""

from agents.convert.convert import convert
from agents.convert.mapping import PRESETS

__all__ = ["PRESETS", "convert"]
