"""Processor levels for ahead-of-time compilation, and those that this machine can run.

Code for x86-64 is compiled for its levels [1], as packages of Linux distributions are; elsewhere
for the generic processor of the architecture.

References:
    [1] x86-64 psABI, section 3.1.1, table 3.1: micro-architecture levels.
"""

from __future__ import annotations

import platform
from functools import cache

import llvmlite.binding as llvm
from numba import config

LEVELS = {
    "x86-64-v4": "avx512f avx512bw avx512cd avx512dq avx512vl",
    "x86-64-v3": "avx avx2 bmi bmi2 f16c fma lzcnt movbe",
    "x86-64-v2": "cx16 popcnt sse3 ssse3 sse4.1 sse4.2",
}
"""Features that a level of x86-64 has beyond the one below it, by the names of LLVM."""


@cache
def fitting_levels() -> tuple[str, ...]:
    """Return the LLVM names of processors whose code runs here; the most capable first."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return ("generic",)
    has, found = _features(), list[str]()
    for level, needed in reversed(LEVELS.items()):
        if not all(has.get(feature) for feature in needed.split()):
            break
        found.insert(0, level)
    return tuple(found)


def has_wide_registers() -> bool:
    """True if vector registers of the target processor hold eight numbers."""
    if config.CPU_NAME is not None:
        return config.CPU_NAME == "x86-64-v4" or "+avx512f" in (config.CPU_FEATURES or "")
    return bool(_features().get("avx512f"))


def _features() -> dict[str, bool]:
    try:
        return dict(llvm.get_host_cpu_features())
    except RuntimeError:  # unknown here
        return {}
