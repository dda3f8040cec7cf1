"""Errors that say, in one line, what is wrong, where, why and what to try.

Every error of the project derives from `BondsightError`, so a program catches one class; each
also derives from the built-in class a Python reader expects (`KeyError`, `ValueError`).
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable

_SHOWN = 12
_LONGEST = 80


class BondsightError(Exception):
    """Base of all errors of this project; `str()` is one plain line.

    Parameters
    ----------
    message : str
        What is wrong, where, why, and what to try. Line breaks become spaces.
    remedies : iterable of str
        What to try, one by one, where a caller may have to leave some out: an option of the command
        line stands in the remedy that it is. They end the line.

    Examples
    --------
    >>> try:
    ...     graph["mas"]
    ... except BondsightError as error:
    ...     print(error)
    no element 'mas' in positioner. Known: body, F, m, d, k, x
    """

    remedies: tuple[str, ...] = ()

    def __init__(self, *message: object, remedies: Iterable[str] = ()) -> None:
        super().__init__(*message)
        self.remedies = tuple(remedies)

    def __str__(self) -> str:
        """Return the message as one plain line (`KeyError` would quote it)."""
        what = " ".join(" ".join(str(part).splitlines()) for part in self.args)
        return "; ".join([what, ", or ".join(self.remedies)]) if self.remedies else what


class UnknownName(BondsightError, KeyError):
    """A name (channel, parameter, element, recording, ...) that nothing carries.

    Examples
    --------
    >>> try:
    ...     run["X"]
    ... except UnknownName as error:
    ...     print(error)
    no channel 'X' in recording run. Did you mean 'x'? Known: F, x
    """


class UnknownArgument(BondsightError, TypeError):
    """A keyword that a function or a class does not take.

    Examples
    --------
    >>> try:
    ...     diagnose(graph, run, tim=60.0)
    ... except UnknownArgument as error:
    ...     print(str(error)[:55])
    diagnose: no argument 'tim'. Did you mean 'time'? Known
    """


class UnusableInput(BondsightError, ValueError):
    """A file, unit or value that cannot be used as it is.

    Examples
    --------
    >>> try:
    ...     simulate(graph, t[:1], {})
    ... except UnusableInput as error:
    ...     print(error)
    positioner: time needs at least two samples on one axis
    """


class GraphError(BondsightError, ValueError):
    """A bond graph that is not well formed or has a true causal conflict.

    Examples
    --------
    >>> try:
    ...     R("2nd", 1.0)
    ... except GraphError as error:
    ...     print(error)
    element name '2nd' is not an identifier: it is the address of the element in ...
    """


def nearest(name: str, known: Iterable[str], count: int = 3) -> tuple[str, ...]:
    """Names most like `name`, best first, without regard to upper and lower case.

    Parameters
    ----------
    name : str
        The name as it was written.
    known : iterable of str
        The names that exist.
    count : int
        At most so many answers.

    Returns
    -------
    tuple of str
        The close matches; empty if nothing is close.

    Examples
    --------
    >>> nearest("Ra", ["R_a", "L_a", "K_t"])[0]
    'R_a'
    """
    names = list(dict.fromkeys(known))
    score = {
        k: max(
            difflib.SequenceMatcher(None, name, k).ratio(),
            difflib.SequenceMatcher(None, name.lower(), k.lower()).ratio() - 0.01,
        )
        for k in names
    }
    for k in names:  # a part of a longer name: stribek for stribeck_friction, pos for position
        for part in re.split(r"[_\s]+", k):
            if len(name) > 2 and part.lower().startswith(name.lower()):
                score[k] = max(score[k], 0.7)
            alike = difflib.SequenceMatcher(None, name.lower(), part.lower()).ratio()
            if len(part) > 3 and alike >= 0.8:
                score[k] = max(score[k], 0.9 * alike)
    close = [k for k in names if score[k] >= 0.6]
    return tuple(sorted(close, key=lambda k: -score[k])[:count])


def unknown_name(kind: str, name: object, where: str, known: Iterable[str]) -> UnknownName:
    """Make (not raise) the error for a name that does not exist.

    Parameters
    ----------
    kind : str
        What the name should name, such as `"channel"` or `"parameter"`.
    name : object
        The name as it was written.
    where : str
        The object or file searched; empty if there is none to tell.
    known : iterable of str
        The names that exist, in the order to show them.

    Returns
    -------
    UnknownName
        To be raised by the caller.

    Examples
    --------
    >>> print(unknown_name("parameter", "Ra", "dc_motor", ["R_a", "L_a"]))
    no parameter 'Ra' in dc_motor. Did you mean 'R_a'? Known: R_a, L_a
    """
    names = list(dict.fromkeys(str(k) for k in known))
    text = str(name)
    written = text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
    close = nearest(written, names)
    place = f" in {where}" if where else ""
    hint = f" Did you mean {' or '.join(repr(k) for k in close)}?" if close else ""
    shown = ", ".join(names[:_SHOWN]) + (
        f", ... ({len(names)} in all)" if len(names) > _SHOWN else ""
    )
    return UnknownName(f"no {kind} {written!r}{place}.{hint} Known: {shown or 'none'}")


def require_known(kind: str, where: str, known: Collection[str], *names: object) -> None:
    """Raise `unknown_name` for the first of the names that is not among those known.

    Examples
    --------
    >>> require_known("parameter", "dc_motor", ["R_a", "L_a"], "R_a", "L_a")
    """
    for name in names:
        if name not in known:
            raise unknown_name(kind, name, where, known)


def real_number(name: str, value: object) -> float:
    """Return `value` as a finite float.

    Raises
    ------
    UnusableInput
        It is none.
    """
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = float("nan")
    if type(value).__name__ in ("bool", "bool_"):  # NumPy's too, without importing it
        number = float("nan")
    if number != number or abs(number) == float("inf"):
        raise UnusableInput(f"{name} = {value!r} is not a finite number; give one")
    return number


def require_positive(where: str, *, or_zero: bool = False, **values: float) -> None:
    """Raise `UnusableInput` for the first value that is not positive and finite."""
    for name, value in values.items():
        if not (0 < value < float("inf") or (or_zero and value == 0)):
            rule = "0 or more" if or_zero else "positive"
            raise UnusableInput(f"{where}: {name} = {value:g} must be {rule} and finite, in SI")
