"""One extended Kalman filter over all nodes of a group."""

from tracking.filters.joint.filter import JointEkf
from tracking.filters.joint.params import JointParams
from tracking.vehicles import VehicleParams

__all__ = ["VehicleParams", "JointEkf", "JointParams"]
