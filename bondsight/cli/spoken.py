"""What a Python reader is told to write, as a shell takes it: arguments become options."""

from __future__ import annotations

import ast
import re
import shlex
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

_TEXT = r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\""""
_PAIR = rf"({_TEXT}|NAME): ({_TEXT}|COLUMN)"
_ENTRY = re.compile(
    rf"(?:(\brecording\.select\()|\bmap=)\{{{_PAIR}(?:, (?!'\*'){_PAIR})?(?:, '\*': '\*')?\}}"
    r"(?(1)\))"
)
_NOISE = re.compile(r"\bnoise=\{(\w+): (\w+)\}")
_ROWS = re.compile(r"\brows=\((\w+), (\w+)\)")
_PLAIN = re.compile(r"(?<![\w-])(fs|resample|fill)=(?=[\w.])")
_BARE = re.compile(r"(?<![\w-])(map|fs|rows|resample|fill)=(?=[);,.]|$)")
_PYTHON_ALONE = re.compile(
    r" (?:or|by) Recording\.select|: (?:graph\.)?remove\('\w+'\)|, silent=\('\w+',\) is 0"
    r"|; estimate\(found\.study\.changed\(n_sub=None\)\) corrects it"
    r"| or initial=\{'\w+': value\}| where a diagnosis ends \(diagnose\(study\)\.study\),"
)
_CALLS = (
    (re.compile(r"\bmany_starts\(study, (\d+)\)"), r"--starts \1"),
    (re.compile(r"\bmany_starts\b"), "--starts 32"),
    (re.compile(r"\bstudy\.starting\(\{NAME: VALUE\}\)"), "--start NAME=VALUE (may be repeated)"),
    (re.compile(r"\b(method|noise)='(\w+)'"), r"--\1 \2"),
    (re.compile(r"\bNuisances\(offsets=False\)"), "--no-offsets"),
    (re.compile(r"\bNuisances\(commands=True\)"), "--command-offsets"),
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
    for call, option in _CALLS:
        text = call.sub(option, text)
    text = _NOISE.sub(r"--noise \1=\2", _ROWS.sub(r"--rows \1:\2", text))
    return _BARE.sub(r"--\1", _PLAIN.sub(r"--\1 ", text))


def at_shell(d: Diagnosis) -> Diagnosis:
    """Return a diagnosis whose remedies name options wherever it is told: text, page and file."""
    return replace(
        d, notes=tuple(map(as_options, d.notes)), advice=tuple(map(as_options, d.advice)),
        written=as_options,
    )  # fmt: skip


def _option(found: re.Match[str]) -> str:
    words = [w if w in ("NAME", "COLUMN") else ast.literal_eval(w) for w in found.groups()[1:] if w]
    pairs = ("=".join(pair) for pair in zip(words[::2], words[1::2], strict=True))
    return " ".join(f"--map {shlex.quote(pair)}" for pair in pairs)
