"""Say every difference between two folders of record.py.

    python tests/proof/unchanged/compare.py BEFORE AFTER

Words must be equal, whole numbers too; other numbers within a relative tolerance. Seconds that
something took, dates, versions and hashes of archives are left out. Exit code 1: there is a
difference.
"""

from __future__ import annotations

import argparse
import difflib
import json
import math
import re
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
TOLERANCE = 1e-6
SHOWN = 8
"""Differences that are printed of one text; the rest is counted."""

NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?!\w)")
WHOLE = re.compile(r"[-+]?\d+")
DATE = r"\d{4}-\d\d-\d\d"
CLOCK = r"\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[-+]\d\d:?\d\d)?"
PROGRAMS = "bondsight|casadi|python|numpy|scipy|sympy|matplotlib|gcc"
ALWAYS = tuple(
    (re.compile(pattern), word)
    for pattern, word in (
        (rf"{DATE}(?:[T ]{CLOCK})?", "{date}"),
        (rf"(?i)({PROGRAMS})([ -/])v?\d+(?:\.\d+)+", r"\1\2{version}"),
        (r'((?:guid|instantiationToken)=|MODEL_TOKEN )"[^"]*"', r'\1"{hash}"'),
        (r"(?:/var)?/tmp/[\w.-]+", "{temporary}"),
        # what a diagnosis took: printed, retold, in its report
        (r"(?m)^\d+(?:\.\d)? s$", "{time}"),
        (r"(?<=\s)\d+(?:\.\d)? s(?=\sverdict: )", "{time}"),
        (r"(?<=; )\d+(?:\.\d)? s(?=, seed)", "{time}"),
        (r"(?<=diagnosed in )\d+(?:\.\d)? s", "{time}"),
        (r"(?<=computed in )[\d.]+ s", "{time}"),
        # a seal is salted
        (r"(?<=truth sealed: )(\s*sha256) [0-9a-f]{64}", r"\1 {hash}"),
        ("\N{MINUS SIGN}", "-"),
    )
)
"""What is left out of every text, and what stands for it."""
TIMES = frozenset({"seconds", "processor_seconds"})


@dataclass(frozen=True)
class Rules:
    """What counts as equal.

    Attributes
    ----------
    tolerance : float
        Relative, of numbers that are not whole; 0 wants equal texts.
    ignore : tuple of patterns
        What is left out of texts.
    without : frozenset of str
        Keys of JSON that are left out.
    wrapped : bool
        Where lines are broken does not count.
    renames : tuple of (str, str)
        Replaced in the texts of the first folder.
    """

    tolerance: float = TOLERANCE
    ignore: tuple[re.Pattern[str], ...] = ()
    without: frozenset[str] = TIMES
    wrapped: bool = False
    renames: tuple[tuple[str, str], ...] = field(default=())

    def normal(self, text: str) -> str:
        """Return `text` without what may differ, each run of blanks within a line as one."""
        if self.wrapped:
            text = " ".join(text.split())
        for pattern in self.ignore:
            text = pattern.sub("{time}", text)
        for pattern, word in ALWAYS:
            text = pattern.sub(word, text)
        return re.sub(r"(?<=\S)[ \t]+", " ", text)

    def renamed(self, text: str) -> str:
        """Return a text of the first folder in the words of the second."""
        for old, new in self.renames:
            text = text.replace(old, new)
        return text

    def same_number(self, a: str, b: str) -> bool:
        """Whether two numbers as written are equal."""
        if a == b:
            return True
        if WHOLE.fullmatch(a) and WHOLE.fullmatch(b):
            return int(a) == int(b)
        return self.same_value(float(a), float(b))

    def same_value(self, a: float, b: float) -> bool:
        """Whether two values are equal within the tolerance."""
        if a == b or (math.isnan(a) and math.isnan(b)):
            return True
        return self.tolerance > 0.0 and abs(a - b) <= self.tolerance * max(abs(a), abs(b))

    def same_line(self, a: str, b: str) -> bool:
        """Whether two lines are equal: words exactly, numbers within the tolerance."""
        if a == b:
            return True
        if NUMBER.split(a) != NUMBER.split(b):
            return False
        return all(map(self.same_number, NUMBER.findall(a), NUMBER.findall(b)))


def of_texts(a: str, b: str, rules: Rules) -> Iterator[str]:
    """Yield one line for each difference of two texts."""
    first = rules.normal(rules.renamed(a)).splitlines()
    second = rules.normal(b).splitlines()
    if len(first) == len(second):
        for k, (x, y) in enumerate(zip(first, second, strict=True), 1):
            if not rules.same_line(x, y):
                yield f"line {k}: {_short(x, y)} -> {_short(y, x)}"
        return
    yield f"{len(first)} lines -> {len(second)} lines"
    for tag, i, j, k, m in difflib.SequenceMatcher(None, first, second, False).get_opcodes():
        if tag != "equal" and not (
            j - i == m - k and all(map(rules.same_line, first[i:j], second[k:m]))
        ):
            yield from (f"- {_short(x)}" for x in first[i:j])
            yield from (f"+ {_short(y)}" for y in second[k:m])


def of_values(a: Any, b: Any, rules: Rules, where: str = "") -> Iterator[str]:
    """Yield one line for each difference of two JSON values."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in (*a, *(k for k in b if k not in a)):
            if key in rules.without:
                continue
            if key not in a or key not in b:
                yield f"{where}.{key}: only {'before' if key in a else 'after'}"
            else:
                yield from of_values(a[key], b[key], rules, f"{where}.{key}")
        if [k for k in a if k in b] != [k for k in b if k in a]:
            yield f"{where}: keys in another order"
    elif isinstance(a, list) and isinstance(b, list):
        if len(a) != len(b):
            yield f"{where}: {len(a)} entries -> {len(b)} entries"
        for k, (x, y) in enumerate(zip(a, b, strict=False)):
            yield from of_values(x, y, rules, f"{where}[{k}]")
    elif isinstance(a, str) and isinstance(b, str):
        yield from (f"{where}: {said}" for said in of_texts(a, b, rules))
    elif type(a) is float and type(b) is float:
        if not rules.same_value(a, b):
            yield f"{where}: {a!r} -> {b!r}"
    elif type(a) is not type(b) or a != b:
        yield f"{where}: {a!r} -> {b!r}"


def of_files(a: Path, b: Path, rules: Rules) -> Iterator[str]:
    """Yield the differences of two files that are in both folders."""
    first, second = a.read_text(encoding="utf-8"), b.read_text(encoding="utf-8")
    if first == second:
        return
    if a.suffix == ".json":
        try:
            yield from of_values(json.loads(rules.renamed(first)), json.loads(second), rules)
        except json.JSONDecodeError:
            yield from of_texts(first, second, rules)
        return
    yield from of_texts(first, second, rules)


def of_folders(a: Path, b: Path, rules: Rules) -> Iterator[str]:
    """Yield the differences of everything that one command left in two folders, by file."""
    first, second = (_files(folder) for folder in (a, b))
    for name in sorted(first | second):
        if name not in first or name not in second:
            yield f"{name}: only {'before' if name in first else 'after'}"
            continue
        found = list(of_files(a / name, b / name, rules))
        yield from (f"{name}: {said}" for said in found[:SHOWN])
        if len(found) > SHOWN:
            yield f"{name}: and {len(found) - SHOWN} more"


def rules_by_command(names: Sequence[str], plain: Rules) -> dict[str, Rules]:
    """Return the rules of each recorded command, as ``commands.toml`` states them."""
    entries = tomllib.loads((HERE / "commands.toml").read_text(encoding="utf-8"))["command"]
    found: dict[str, Rules] = {}
    for entry in entries:
        pattern = re.escape(entry["name"].replace(":", "_"))
        for word, values in entry.get("each", {}).items():
            either = "|".join(re.escape(v.replace(":", "_")) for v in values)
            pattern = pattern.replace(re.escape(f"{{{word}}}"), f"(?:{either})")
        rules = Rules(
            plain.tolerance,
            tuple(re.compile(p) for p in entry.get("ignore", ())),
            TIMES | frozenset(entry.get("without", ())),
            entry.get("wrapped", False),
            plain.renames,
        )
        found |= {n: rules for n in names if re.fullmatch(pattern, n)}
    return found


def _files(folder: Path) -> set[str]:
    paths = (p for p in folder.rglob("*") if p.is_file())
    names = (p.relative_to(folder).as_posix() for p in paths)
    return {n for n in names if n != "about.json" and not n.startswith(".")}


def _short(line: str, other: str = "") -> str:
    """Return a line, cut to what surrounds its first difference from `other`."""
    at = next((k for k, (x, y) in enumerate(zip(line, other, strict=False)) if x != y), 0)
    begin = max(at - 40, 0)
    piece = line[begin : begin + 120]
    return repr(("..." if begin else "") + piece + ("..." if begin + 120 < len(line) else ""))


def _pair(text: str) -> tuple[str, str]:
    old, sign, new = text.partition("=")
    if not (old and sign):
        raise argparse.ArgumentTypeError(f"{text!r} is not OLD=NEW")
    return old, new


def main(arguments: Sequence[str] | None = None) -> int:
    """Print every difference; returns 1 if there is one."""
    p = argparse.ArgumentParser(description="say every difference between two recordings")
    p.add_argument("before", type=Path)
    p.add_argument("after", type=Path)
    p.add_argument("--tolerance", type=float, default=TOLERANCE, help="relative; %(default)g")
    p.add_argument("--exact", action="store_true", help="no tolerance")
    p.add_argument("--only-common", action="store_true", help="only commands that both hold")
    p.add_argument("--rename", type=_pair, action="append", default=[], metavar="OLD=NEW",
                   help="a word of before that is meant to have changed")  # fmt: skip
    options = p.parse_args(arguments)
    for folder in (options.before, options.after):
        if not folder.is_dir():
            p.error(f"{folder} is no folder; give two folders of record.py")
    tolerance = 0.0 if options.exact else options.tolerance
    plain = Rules(tolerance, renames=tuple(options.rename))
    first, second = ({d.name for d in f.iterdir() if (d / "result.json").is_file()}
                     for f in (options.before, options.after))  # fmt: skip
    names = sorted(first & second)
    found = [] if options.only_common else [
        f"{n}: only {'before' if n in first else 'after'}" for n in sorted(first ^ second)
    ]  # fmt: skip
    rules = rules_by_command(names, plain)
    bad = set()
    for name in names:
        said = of_folders(options.before / name, options.after / name, rules.get(name, plain))
        for line in said:
            bad.add(name)
            found.append(f"{name}/{line}")
    print(*found, sep="\n", end="\n" if found else "")
    print(f"{len(names)} commands compared, {len(bad)} differ, {len(first ^ second)} on one side")
    return int(bool(found) or not names)


if __name__ == "__main__":
    sys.exit(main())
