"""Nodes and cars that are not there, in a simulated world: what `relpos emulate` does."""

from agents.emulate.options import EmulateOptions
from agents.emulate.result import EmulateResult
from agents.emulate.rig import EmulatedRig
from agents.emulate.run import emulate

__all__ = ["EmulateOptions", "EmulateResult", "EmulatedRig", "emulate"]
