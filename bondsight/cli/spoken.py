"""What a Python reader is told to write, as a shell takes it: arguments become options."""

from __future__ import annotations

import ast
import re
import shlex

_TEXT = r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\""""
_ENTRY = re.compile(
    rf"(?:(\brecording\.select\()|\bmap=)\{{({_TEXT}|NAME): ({_TEXT}|COLUMN)(?:, '\*': '\*')?\}}"
    r"(?(1)\))"
)
_ROWS = re.compile(r"\brows=\((\w+), (\w+)\)")
_PLAIN = re.compile(r"(?<![\w-])(fs|resample|fill)=(?=[\w.])")
_BARE = re.compile(r"(?<![\w-])(map|fs|rows|resample|fill)=(?=[);,.]|$)")
_PYTHON_ALONE = re.compile(
    r" (?:or|by) Recording\.select|: (?:graph\.)?remove\('\w+'\)|, silent=\('\w+',\) is 0"
)


def as_options(text: str) -> str:
    """Return a line of an error with options in place of arguments.

    Remedies that only a program has are left out.

    Examples
    --------
    >>> print(as_options("no channel 'x'; name it with map={'x': 'two words[m]'}, rows=(3, 9)"))
    no channel 'x'; name it with --map 'x=two words[m]', --rows 3:9
    """
    text = _PYTHON_ALONE.sub("", _ENTRY.sub(_option, text))
    text = _ROWS.sub(r"--rows \1:\2", text)
    return _BARE.sub(r"--\1", _PLAIN.sub(r"--\1 ", text))


def _option(found: re.Match[str]) -> str:
    words = (w if w in ("NAME", "COLUMN") else ast.literal_eval(w) for w in found.groups()[1:])
    return f"--map {shlex.quote('='.join(words))}"
