"""Names of a model as identifiers of another language, and comments that cannot end early."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from bondgraph.support.errors import BondsightError


def ascii_identifier(name: str) -> str:
    """Return `name` in letters, digits and underscores; other letters become ``u`` and their code.

    Raises
    ------
    BondsightError
        If nothing is left of the name.

    Examples
    --------
    >>> ascii_identifier("R_é"), ascii_identifier("my model"), ascii_identifier("3d")
    ('R_u00e9', 'my_model', '_3d')
    """
    text = "".join(
        c if re.fullmatch(r"[A-Za-z0-9_]", c) else f"u{ord(c):04x}" if c.isalnum() else "_"
        for c in name
    )
    if not text.strip("_"):
        raise BondsightError(f"the name {name!r} has no letter or digit; rename it for an export")
    return f"_{text}" if text[0].isdigit() else text


def distinct(names: Iterable[str], reserved: Collection[str] = ()) -> dict[str, str]:
    """Return an identifier for each name; a reserved or repeated one gets trailing underscores.

    Examples
    --------
    >>> distinct(["lambda", "a b", "a_b"], {"lambda"})
    {'lambda': 'lambda_', 'a b': 'a_b', 'a_b': 'a_b_'}
    """
    found: dict[str, str] = {}
    taken = set(reserved)
    for name in dict.fromkeys(names):
        text = ascii_identifier(name)
        while text in taken:
            text += "_"
        taken.add(text)
        found[name] = text
    return found


def comment(text: str) -> str:
    """Return text for a comment of one line: nothing in it can end the comment.

    Examples
    --------
    >>> comment("N*s/m of */ x")
    'N*s/m of * / x'
    """
    plain = "".join(c if 32 <= ord(c) < 127 and c not in "\\?" else "." for c in text)
    return plain.replace("*/", "* /").replace("/*", "/ *")
