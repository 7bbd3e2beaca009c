"""One extended Kalman filter per pair: the pipeline of the paper."""

from tracking.filters.pair.filter import PairEkf
from tracking.filters.pair.params import PairEkfParams

__all__ = ["PairEkf", "PairEkfParams"]
