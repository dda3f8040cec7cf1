"""A verdict file read back as data, strictly, and said again in plain words."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from bondgraph.support.errors import UnusableInput

SCHEMA = "bondsight.verdict/1"
KINDS = (
    "explained", "parameters_only", "missing_physics", "unknown_physics", "insufficient_data"
)  # fmt: skip
LARGEST = 20_000_000
NAMED = ("missing_physics", "unknown_physics")

Data = Mapping[str, Any]


def read_verdict(file: Path | str) -> dict[str, Any]:
    """Read and check a ``verdict.json``; nothing in it is executed or looked up as code.

    Parameters
    ----------
    file : Path or str

    Returns
    -------
    dict
        The verdict; keys that the schema does not know are kept.

    Raises
    ------
    UnusableInput
        The file is absent, too large, no JSON, of another schema, or a key is missing or of the
        wrong type; one line says which.
    """
    path = Path(file)
    try:
        if path.is_dir():
            raise UnusableInput(
                f"{path} is a folder: name the verdict file in it, {path / 'verdict.json'}"
            )
        if path.stat().st_size > LARGEST:
            raise UnusableInput(f"{path} is larger than any verdict: is it the right file?")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise UnusableInput(
            f"cannot read {path}: {error.strerror or error}; bondsight diagnose writes verdict.json"
        ) from None
    except UnicodeDecodeError:
        raise UnusableInput(f"{path} is not a text file: a verdict is JSON in UTF-8") from None
    return parse_verdict(text, str(path))


def parse_verdict(text: str, name: str = "the verdict") -> dict[str, Any]:
    """Check the text of a verdict; see `read_verdict`."""
    try:
        found = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise UnusableInput(
            f"{name} is not JSON: {error.msg} in line {error.lineno}; was it cut short or edited?"
        ) from None
    except (ValueError, RecursionError) as error:
        raise UnusableInput(f"{name} is not the JSON of a verdict: {_short(error)}") from None
    _Checker(name).verdict(found)
    return dict(found)


def _no_constant(text: str) -> NoReturn:
    raise ValueError(f"it holds {text}, which is no JSON number")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key occurs twice in one object")
    return found


def _short(error: Exception) -> str:
    return "it is nested too deeply" if isinstance(error, RecursionError) else str(error)[:120]


_TYPES: dict[str, tuple[type, ...]] = {
    "text": (str,), "number": (int, float), "whole number": (int,), "object": (dict,),
    "list": (list,), "true or false": (bool,),
}  # fmt: skip


class _Checker:
    """Checks keys and types; every refusal names the file and the path of the key."""

    def __init__(self, name: str) -> None:
        self.name = name

    def refuse(self, what: str) -> NoReturn:
        raise UnusableInput(
            f"{self.name} is not a verdict of schema {SCHEMA}: {what}; write it anew with "
            "bondsight diagnose"
        )

    def of_type(self, value: Any, kind: str, where: str) -> Any:
        right = isinstance(value, _TYPES[kind])
        if isinstance(value, bool) and kind in ("number", "whole number"):
            right = False
        if not right or (kind == "number" and not math.isfinite(value)):
            self.refuse(f"{where} is not a {kind}" if kind != "object" else f"{where} is no object")
        return value

    def get(self, holder: Data, key: str, kind: str, where: str = "") -> Any:
        path = f"{where}.{key}" if where else key
        if key not in holder:
            self.refuse(f"{path} is missing")
        return self.of_type(holder[key], kind, path)

    def items(self, holder: Data, key: str, kind: str, where: str = "") -> list[Any]:
        path = f"{where}.{key}" if where else key
        found = self.get(holder, key, "list", where)
        return [self.of_type(v, kind, f"{path}[{i}]") for i, v in enumerate(found)]

    def share(self, holder: Data, key: str, where: str, *, least: float = 0.0) -> None:
        if not least <= self.get(holder, key, "number", where) <= 1.0 + 1e-9:
            self.refuse(f"{where}.{key} is not between {least:g} and 1")

    def numbers(self, holder: Data, key: str, where: str) -> dict[str, float]:
        found: dict[str, float] = self.get(holder, key, "object", where)
        for n, v in found.items():
            if self.of_type(v, "number", f"{where}.{key}.{n}") < 0:
                self.refuse(f"{where}.{key}.{n} is negative")
        return found

    def verdict(self, v: Any) -> None:
        self.of_type(v, "object", "the whole file")
        if v.get("schema") != SCHEMA:
            self.refuse(f"its schema is {str(v.get('schema', 'not given'))[:60]!r}")
        kind = self.get(v, "verdict", "text")
        if kind not in KINDS:
            self.refuse(f"verdict {kind[:40]!r} is none of {', '.join(KINDS)}")
        self.get(v, "model", "text")
        recording = self.get(v, "recording", "object")
        self.get(recording, "name", "text", "recording")
        self.get(recording, "sha256", "text", "recording")
        self.get(recording, "samples", "whole number", "recording")
        self.items(recording, "channels", "text", "recording")
        if "parts" in recording:
            for i, part in enumerate(self.items(recording, "parts", "object", "recording")):
                self.get(part, "name", "text", f"recording.parts[{i}]")
                self.get(part, "sha256", "text", f"recording.parts[{i}]")
                self.get(part, "samples", "whole number", f"recording.parts[{i}]")
        findings = self.items(v, "findings", "object")
        if bool(findings) != (kind in NAMED):
            self.refuse(f"a verdict {kind} has {'' if kind in NAMED else 'no '}findings")
        for i, f in enumerate(findings):
            self.finding(f, f"findings[{i}]")
        self.fit(self.get(v, "fit", "object"))
        for i, n in enumerate(self.items(v, "nuisances", "object")):
            self.value(n, f"nuisances[{i}]")
            self.get(n, "within_bounds", "true or false", f"nuisances[{i}]")
        self.items(v, "advice", "text")
        self.get(v, "seconds", "number")
        self.get(v, "seed", "whole number")
        if "notes" in v:
            self.items(v, "notes", "text")
        if "parameters" in v:
            self.parameters(v, "")

    def finding(self, f: Data, where: str) -> None:
        place = self.get(f, "location", "object", where)
        self.get(place, "element", "text", f"{where}.location")
        self.get(place, "kind", "text", f"{where}.location")
        self.items(place, "indistinguishable_from", "text", f"{where}.location")
        for key in ("effect", "family", "law"):
            self.get(f, key, "text", where)
        self.share(f, "confidence", where)
        self.share(f, "share_of_misfit_explained", where, least=-1.0)
        self.parameters(f, where)
        for i, p in enumerate(self.items(f, "also_possible", "object", where)):
            for key in ("effect", "element", "evidence"):
                self.get(p, key, "text", f"{where}.also_possible[{i}]")

    def parameters(self, holder: Data, where: str) -> None:
        path = f"{where}.parameters" if where else "parameters"
        for i, p in enumerate(self.items(holder, "parameters", "object", where)):
            self.value(p, f"{path}[{i}]")
            ends = self.get(p, "ci95", "list", f"{path}[{i}]")
            if len(ends) != 2:
                self.refuse(f"{path}[{i}].ci95 does not have two ends")
            for e in ends:
                if e is not None:
                    self.of_type(e, "number", f"{path}[{i}].ci95")

    def value(self, p: Data, where: str) -> None:
        self.get(p, "name", "text", where)
        self.get(p, "unit", "text", where)
        if "value" not in p:
            self.refuse(f"{where}.value is missing")
        if p["value"] is not None:
            self.of_type(p["value"], "number", f"{where}.value")

    def fit(self, f: Data) -> None:
        self.numbers(f, "noise_floor", "fit")
        for model in ("nominal", "repaired"):
            errors = self.get(f, model, "object", "fit")
            for part in ("train_rmse", "test_rmse"):
                self.numbers(errors, part, f"fit.{model}")
