"""Values as plain JSON and back, exactly: tuples stay tuples, infinity stays infinity.

Two tags carry what JSON lacks: ``{"$tuple": [...]}`` and ``{"$float": "inf" | "-inf" | "nan"}``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bondgraph.support.errors import UnusableInput

MAX_DEPTH = 60
MAX_BITS = 4096


def to_plain(value: Any, place: str, depth: int = 0) -> Any:
    """Return a value as what JSON holds.

    Parameters
    ----------
    value : object
        Mappings with text keys, lists, tuples, texts, numbers (NumPy scalars become Python's),
        flags and None.
    place : str
        What to call the value in an error.

    Returns
    -------
    object
        Fresh dicts, lists, texts, finite numbers, flags and None.

    Raises
    ------
    UnusableInput
        Anything else, a key that is no text or begins with ``$``, or more than 60 levels.

    Examples
    --------
    >>> to_plain({"ci": (0.0, float("inf"))}, "fit")
    {'ci': {'$tuple': [0.0, {'$float': 'inf'}]}}
    """
    if depth > MAX_DEPTH:
        raise UnusableInput(f"{place}: more than {MAX_DEPTH} levels; nest less")
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | str):
        return str(value) if isinstance(value, str) else value
    if isinstance(value, int):
        if value.bit_length() > MAX_BITS:
            raise UnusableInput(f"{place}: a whole number of {value.bit_length()} bits; use fewer")
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"$float": repr(float(value))}
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str) or key.startswith("$"):
                raise UnusableInput(
                    f"{place}: the key {key!r} cannot be stored; use a text that does not begin "
                    "with '$'"
                )
        return {str(k): to_plain(v, f"{place}[{k!r}]", depth + 1) for k, v in value.items()}
    if isinstance(value, list | tuple):
        items = [to_plain(v, f"{place}[{i}]", depth + 1) for i, v in enumerate(value)]
        return {"$tuple": items} if isinstance(value, tuple) else items
    what = "an array; store it among the arrays" if isinstance(value, np.ndarray) else "no plain"
    if what == "no plain":
        what = f"a {type(value).__name__}; store numbers, texts, lists, tuples and mappings"
    raise UnusableInput(f"{place}: is {what}")


def from_plain(value: Any, place: str) -> Any:
    """Return the value that `to_plain` made plain.

    Raises
    ------
    UnusableInput
        A tag is not one of the two.

    Examples
    --------
    >>> from_plain({"ci": {"$tuple": [0.0, {"$float": "inf"}]}}, "fit")
    {'ci': (0.0, inf)}
    """
    if isinstance(value, list):
        return [from_plain(v, f"{place}[{i}]") for i, v in enumerate(value)]
    if not isinstance(value, dict):
        return value
    tag = next((k for k in value if k.startswith("$")), None)
    if tag is None:
        return {k: from_plain(v, f"{place}[{k!r}]") for k, v in value.items()}
    content = value[tag]
    if len(value) == 1 and tag == "$tuple" and isinstance(content, list):
        return tuple(from_plain(content, place))
    if len(value) == 1 and tag == "$float" and content in ("inf", "-inf", "nan"):
        return float(content)
    raise UnusableInput(f"{place}: the tag {tag!r} is not known; the file was changed or is newer")
