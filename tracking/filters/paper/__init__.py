"""The algorithm of the paper as written in its text."""

from tracking.filters.paper.filter import PaperEkf
from tracking.filters.paper.params import PaperParams

__all__ = ["PaperEkf", "PaperParams"]
