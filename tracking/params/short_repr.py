"""A short `repr` for dataclasses that hold arrays or long lists."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

LONGEST = 60
"""[-] Maximum length; longer texts are cut."""
MOST = 6
"""[-] Maximum items of a sequence; longer ones are shown by their length."""


def short_repr(self: Any) -> str:
    """Return ``Class(field=value, ...)`` with type and shape in place of array contents.

    Use it as ``__repr__ = short_repr`` in the body of a dataclass.
    """
    parts = (f"{f.name}={_short(getattr(self, f.name))}" for f in fields(self) if f.repr)
    return f"{type(self).__name__}({', '.join(parts)})"


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{list(value.shape)}"
    if isinstance(value, list | tuple | dict | set | frozenset) and len(value) > MOST:
        return f"<{type(value).__name__} of {len(value)}>"
    if isinstance(value, list | tuple) and any(map(_is_large, value)):
        return f"<{type(value).__name__} of {len(value)}>"
    if isinstance(value, dict) and any(map(_is_large, value.values())):
        return f"<dict of {len(value)}>"
    if _is_large(value):
        name = getattr(value, "name", None)
        return f"<{type(value).__name__}{f' {name!r}' if isinstance(name, str) else ''}>"
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def _is_large(value: Any) -> bool:
    """True for arrays and instances of dataclasses."""
    return isinstance(value, np.ndarray) or (is_dataclass(value) and not isinstance(value, type))
