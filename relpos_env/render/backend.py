"""Lazy import of the drawing library."""

from __future__ import annotations

import importlib
import os
from types import ModuleType

from relpos_env.errors import EnvError


def load_pygame() -> ModuleType:
    """Return the module ``pygame``.

    Raises:
        EnvError: pygame is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # no banner on standard output
    try:
        return importlib.import_module("pygame")
    except ImportError as error:
        text = "drawing needs pygame: pip install -e '.[render]' in its source folder"
        raise EnvError(text) from error
