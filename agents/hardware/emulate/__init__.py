"""Nodes and cars that are not there, in a simulated world: what `relpos emulate` does."""

from agents.hardware.emulate.options import EmulateOptions
from agents.hardware.emulate.result import EmulateResult
from agents.hardware.emulate.rig import EmulatedRig
from agents.hardware.emulate.run import emulate

__all__ = ["EmulateOptions", "EmulateResult", "EmulatedRig", "emulate"]
