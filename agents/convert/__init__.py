"""Convert recordings of other projects to log folders (`relpos convert`)."""

from agents.convert.convert import Conversion, StreamUse, convert
from agents.convert.mapping import PRESETS

__all__ = ["PRESETS", "Conversion", "StreamUse", "convert"]
