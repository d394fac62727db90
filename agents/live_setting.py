"""Live settings: parameters of a model that are read from its groups, and change them when they are set."""

from __future__ import annotations

from typing import Any

from teamsight import checks


class LiveSetting:
    """A parameter of a model that belongs to one of its groups.

    Parameters
    ----------
    group : str
        The model's attribute that holds the group.
    name : str
        The group's attribute.
    """

    def __init__(self, group: str, name: str) -> None:
        self._group, self._name = group, name
        self.__doc__ = f"``{group}.{name}``; what is set takes effect from the next step on."

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        return self if model is None else getattr(getattr(model, self._group), self._name)

    def __set__(self, model: Any, value: Any) -> None:
        group = getattr(model, self._group, None)
        if group is None:
            raise AttributeError(f"{self._name}: belongs to {self._group}; set it after super().__init__(…)")
        setattr(group, self._name, value)


class FixedSetting:
    """A parameter with which a model was built, and which cannot be changed.

    Parameters
    ----------
    cure : str
        What to do instead.
    """

    def __init__(self, cure: str) -> None:
        self._cure = cure

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        return self if model is None else model.settings[self._name]

    def __set__(self, model: Any, value: Any) -> None:
        raise AttributeError(f"{self._name}={checks.shown(value)}: is fixed when the model is built; {self._cure}")
