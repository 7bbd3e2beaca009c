"""Puts kernels that were compiled ahead into a wheel: `make wheel`.

`RELPOS_KERNELS` names a folder with a copy of the packages for each kind of processor, in which
`relpos warmup` ran. Without it a wheel has no code, as a source distribution, and compiles when it
is first used.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

CACHE, SHIPPED = "__pycache__", "__compiled__"
"""Where numba keeps code, and where `tracking.kernels.compile_units` finds shipped code."""


class KernelHook(BuildHookInterface):  # type: ignore[misc]
    """Adds the code; the wheel then is for one version of Python and one kind of system."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before files are collected."""
        folder = os.environ.get("RELPOS_KERNELS")
        if not folder:
            return
        found = {}
        for level in sorted(Path(folder).resolve().iterdir()):
            for file in level.rglob(f"{CACHE}/*.nb?"):
                module = file.parent.parent.relative_to(level)
                found[str(file)] = str(module / SHIPPED / level.name / file.name)
        if not found:
            raise FileNotFoundError(f"RELPOS_KERNELS: no compiled kernels in {folder}")
        build_data["force_include"].update(found)
        build_data["pure_python"], build_data["infer_tag"] = False, True
