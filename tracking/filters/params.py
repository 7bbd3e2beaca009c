"""Parameters of the position filters, one class for each kind of filter."""

from __future__ import annotations

from dataclasses import dataclass, field

from tracking.filters.joint.params import JointParams
from tracking.filters.pair.params import PairEkfParams
from tracking.filters.paper.params import PaperParams


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterParams:
    """Parameters of every filter; each reads its own."""

    joint: JointParams = field(default_factory=JointParams)
    pair: PairEkfParams = field(default_factory=PairEkfParams)
    paper: PaperParams = field(default_factory=PaperParams)
