"""The drawing library, imported when the first picture is wanted and not before."""

from __future__ import annotations

import importlib
import os
from types import ModuleType

from relpos_env.errors import EnvError


def load_pygame() -> ModuleType:
    """The module ``pygame``.

    Raises:
        EnvError: It is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # its greeting on standard output
    try:
        return importlib.import_module("pygame")
    except ImportError as error:
        raise EnvError("drawing needs pygame: pip install relpos-env[render]") from error
