"""Arguments that a function or a class does not have: the nearest one it has is offered."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

from bondgraph.support.errors import UnknownArgument, unknown_name

_Made = TypeVar("_Made", bound=Callable[..., Any])


def spelled(made: _Made) -> _Made:
    """Return a function, or a class by its ``__init__``, that says what a wrong keyword may mean.

    Examples
    --------
    >>> @spelled
    ... def search(time=None): ...
    >>> try:
    ...     search(tim=60.0)
    ... except TypeError as error:
    ...     print(error)
    search: no argument 'tim'. Did you mean 'time'? Known: time
    """
    if isinstance(made, type):
        made.__init__ = _checked(made.__init__, made.__name__)  # type: ignore[misc]
        return made
    checked: _Made = _checked(made, made.__name__)
    return checked


def _checked(function: Any, where: str) -> Any:
    code = function.__code__
    known = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]

    @wraps(function)
    def called(*values: Any, **options: Any) -> Any:
        for name in options:
            if name not in known:
                offered = (n for n in known if n not in ("self", "cls"))
                raise UnknownArgument(f"{where}: {unknown_name('argument', name, '', offered)}")
        return function(*values, **options)

    return called
