"""Names that neither C, XML nor a file system can misread."""

from __future__ import annotations

import re
from collections.abc import Iterable

_RESERVED = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if "
    "inline int long register restrict return short signed sizeof static struct switch typedef "
    "union unsigned void volatile while alignas alignof bool catch class constexpr delete "
    "dynamic_cast explicit export false friend mutable namespace new noexcept nullptr operator "
    "private protected public reinterpret_cast static_assert static_cast template this throw true "
    "try typeid typename using virtual and or not xor bitand bitor compl asm main "
    # files of these names cannot exist on Windows
    "con prn aux nul com1 com2 com3 com4 com5 com6 com7 com8 com9 "
    "lpt1 lpt2 lpt3 lpt4 lpt5 lpt6 lpt7 lpt8 lpt9".split()
)
_LONGEST = 60
_STRUCTURED = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")


def identifier(name: str) -> str:
    """Return `name` as a C identifier that may also name a file.

    Other characters become ``_``, a digit in front gets ``model_`` before it, a reserved word
    ``_model`` behind it; what is longer than 60 characters is cut.

    Examples
    --------
    >>> identifier("stack 2"), identifier("while"), identifier("2nd")
    ('stack_2', 'while_model', 'model_2nd')
    """
    clean = re.sub(r"[^A-Za-z0-9_]", "_", name)[:_LONGEST]
    if not clean.strip("_"):
        return "model"
    if clean[0].isdigit() or clean[0] == "_":
        clean = f"model_{clean.lstrip('_')}"
    return f"{clean}_model" if clean.lower() in _RESERVED else clean


def unique(kinds: Iterable[tuple[str, Iterable[str]]]) -> dict[str, tuple[str, ...]]:
    """Names of all variables by kind; one taken already becomes ``kind.name``, then ``kind.name_``.

    Examples
    --------
    >>> unique([("output", ["x"]), ("state", ["x", "v"])])
    {'output': ('x',), 'state': ('state.x', 'v')}
    """
    taken: set[str] = set()
    found: dict[str, tuple[str, ...]] = {}
    for kind, names in kinds:
        row = []
        for name in names:
            free = name if name not in taken else f"{kind}.{name}"
            while free in taken:
                free += "_"
            taken.add(free)
            row.append(free)
        found[kind] = tuple(row)
    return found


def structured(names: Iterable[str]) -> bool:
    """Tell whether all names fit the naming convention ``structured`` of FMI."""
    return all(_STRUCTURED.fullmatch(name) for name in names)
