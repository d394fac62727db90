"""Settings of a model: parameters that read and change its groups, and parameters that are fixed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, Never, overload

from teamsight.agents.settings import Given, Got
from teamsight.core import checks


class LiveSetting(Generic[Got, Given]):
    """A parameter of a model that is the attribute `name` of its group ``model.<group>``.

    ``resolve(model, value)`` returns the value for the group.
    """

    def __init__(self, group: str, name: str, resolve: Callable[[Any, Any], Any] = lambda model, value: value) -> None:
        self._group, self._name, self._resolve = group, name, resolve
        self.__doc__ = f"``{group}.{name}``; a new value takes effect from the next step on."

    @overload
    def __get__(self, model: None, owner: type) -> LiveSetting[Got, Given]: ...
    @overload
    def __get__(self, model: object, owner: type) -> Got: ...
    def __get__(self, model: Any, owner: type) -> Any:
        return self if model is None else getattr(getattr(model, self._group), self._name)

    def __set__(self, model: Any, value: Given) -> None:
        group = getattr(model, self._group, None)
        if group is None:
            raise AttributeError(f"{self._name}: belongs to {self._group}; set it after super().__init__(…)")
        setattr(group, self._name, self._resolve(model, value))


class FixedSetting:
    """A parameter that cannot be changed.

    The error names the `cure`. The value is that of the model's attribute `source`, under the parameter's name; by
    default that with which the model was built.
    """

    def __init__(self, cure: str, source: str | None = None) -> None:
        self._cure, self._source = cure, source

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        if model is None:
            return self
        built = model.settings.get(self._name)
        return built if self._source is None else getattr(getattr(model, self._source), self._name, built)

    def __set__(self, model: Any, value: Never) -> None:
        raise AttributeError(f"{self._name}={checks.shown(value)}: is fixed when the model is built; {self._cure}")


class SettingOfGroups:
    """A setting of groups that a world does not have: setting it on a world raises an error.

    In a subclass of `World` it is an ordinary attribute, so that models can have parameters of these names.
    """

    def __set_name__(self, owner: type, name: str) -> None:
        self._owner, self._name = owner, name

    def __get__(self, model: Any, owner: type | None = None) -> Any:
        if model is None:
            return self
        try:
            return vars(model)[self._name]
        except KeyError:
            name = self._name
            kind = type(model).__name__
            raise AttributeError(f"{kind!r} object has no attribute {name!r}; use that of a group") from None

    def __set__(self, model: Any, value: Any) -> None:
        if type(model) is self._owner:
            name = self._name
            raise AttributeError(f"{name}={checks.shown(value)}: belongs to each group; set group.{name}")
        model.__dict__[self._name] = value
