"""Attribute access of Stable-Baselines3 to a vector environment with shared attributes."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.vec_env import VecEnv


class SharedAttributeVecEnv(VecEnv):  # type: ignore[misc]
    """Vector environment whose agent slots share attributes and methods; nothing is wrapped."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of this environment, once per requested agent slot."""
        return [getattr(self, attr_name)] * len(self._slots_of(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute that all agent slots share."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method once and return its result once per requested agent slot."""
        result = getattr(self, method_name)(*method_args, **method_kwargs)
        return [result] * len(self._slots_of(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for every requested agent slot."""
        return [False] * len(self._slots_of(indices))

    def _slots_of(self, indices: Any) -> list[int]:
        return list(self._get_indices(indices))
