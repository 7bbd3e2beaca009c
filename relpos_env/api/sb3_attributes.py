"""What Stable-Baselines3 may ask of a vector environment whose seats share everything."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.vec_env import VecEnv


class SharedAttributeVecEnv(VecEnv):  # type: ignore[misc]
    """Attributes and methods are those of the whole; nothing is wrapped."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of this environment, once for every seat asked for."""
        return [getattr(self, attr_name)] * len(self._seats_of(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute; the seats share it."""
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method once; its result for every seat asked for."""
        result = getattr(self, method_name)(*method_args, **method_kwargs)
        return [result] * len(self._seats_of(indices))

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """False for every seat asked for."""
        return [False] * len(self._seats_of(indices))

    def _seats_of(self, indices: Any) -> list[int]:
        return list(self._get_indices(indices))
