"""Emulate the devices of nodes and cars in a simulated world (`relpos emulate`)."""

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.result import EmulateResult
from agents.hardware.emulate.rig import EmulatedRig
from agents.hardware.emulate.run import emulate

__all__ = ["EmulateOptions", "EmulateResult", "EmulatedRig", "emulate"]
