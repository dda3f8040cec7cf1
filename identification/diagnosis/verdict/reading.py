"""A verdict file read back as data, strictly, and said again in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from bondgraph.support.bounds import Bound, NonNegative, one_of
from bondgraph.support.errors import UnusableInput
from bondgraph.support.json_text import plain_data
from bondgraph.support.typed_reader import Rules, any_text, record, require_object
from identification.diagnosis.verdict.document import KINDS, SCHEMA

NAMED = ("missing_physics", "unknown_physics")


def _share(least: float) -> Bound:
    return Bound(f"between {least:g} and 1", lambda v: least <= v <= 1.0 + 1e-9)


@dataclass(frozen=True, slots=True)
class _Part:
    name: str
    sha256: str
    samples: int


@dataclass(frozen=True, slots=True)
class _Recording:
    name: str
    sha256: str
    samples: int
    channels: tuple[str, ...]
    parts: tuple[_Part, ...] = ()


@dataclass(frozen=True, slots=True)
class _Location:
    element: str
    kind: str
    indistinguishable_from: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Estimate:
    name: str
    unit: str
    value: float | None
    ci95: tuple[float | None, float | None]
    meaning: str = ""
    remark: str = ""


@dataclass(frozen=True, slots=True)
class _Constant:
    name: str
    unit: str
    value: float
    meaning: str = ""


@dataclass(frozen=True, slots=True)
class _Nuisance:
    name: str
    unit: str
    value: float | None
    within_bounds: bool
    ci95: tuple[float | None, float | None] = (None, None)
    words: str = ""
    over_noise: float | None = None


@dataclass(frozen=True, slots=True)
class _Rival:
    effect: str
    element: str
    evidence: str
    kind: str = ""
    kind_words: str = ""


@dataclass(frozen=True, slots=True)
class _Near:
    effect: str
    element: str
    share: Annotated[float, _share(0.0)]
    kind: str = ""
    kind_words: str = ""


@dataclass(frozen=True, slots=True)
class _Finding:
    location: _Location
    effect: str
    family: str
    law: str
    confidence: Annotated[float, _share(0.0)]
    share_of_misfit_explained: Annotated[float, _share(-1.0)]
    parameters: tuple[_Estimate, ...]
    also_possible: tuple[_Rival, ...]
    answer: str = ""
    kind: str = ""
    law_fit: float | None = None
    probability: Annotated[float, _share(0.0)] = 0.0
    constants: tuple[_Constant, ...] = ()
    kind_words: str = ""
    sentence: str = ""
    formula: str = ""
    nearest: tuple[_Near, ...] = ()


@dataclass(frozen=True, slots=True)
class _Left:
    over_noise: float | None
    place: tuple[str, ...] = ()
    kind: str = ""
    regions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Errors:
    train_rmse: Mapping[str, NonNegative]
    test_rmse: Mapping[str, NonNegative]


@dataclass(frozen=True, slots=True)
class _Fit:
    noise_floor: Mapping[str, NonNegative]
    nominal: _Errors
    repaired: _Errors


@dataclass(frozen=True, slots=True)
class _Tried:
    effect: str
    element: str
    over_noise: float | None
    behind: float | None
    why: str


@dataclass(frozen=True, slots=True)
class _Step:
    before: float | None
    reasons: tuple[str, ...]
    tried: tuple[_Tried, ...]


@dataclass(frozen=True, slots=True)
class _Place:
    elements: tuple[str, ...]
    why: str


@dataclass(frozen=True, slots=True)
class _Told:
    text: str
    value: float | None
    unit: str
    ci95: tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class _Together:
    names: tuple[str, ...]
    words: str
    told: tuple[_Told, ...] = ()


@dataclass(frozen=True, slots=True)
class _Verdict:
    verdict: Annotated[str, one_of(*KINDS)]
    model: str
    recording: _Recording
    findings: tuple[_Finding, ...]
    fit: _Fit
    nuisances: tuple[_Nuisance, ...]
    advice: tuple[str, ...]
    seconds: float
    seed: int
    notes: tuple[str, ...] = ()
    parameters: tuple[_Estimate, ...] = ()
    remaining: Mapping[str, _Left] = field(default_factory=dict)
    suspects: tuple[str, ...] = ()
    regions: tuple[str, ...] = ()
    steps: tuple[_Step, ...] = ()
    places: tuple[_Place, ...] = ()
    together: tuple[_Together, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse findings where the verdict has none, and none where it has some."""
        if bool(self.findings) != (self.verdict in NAMED):
            some = "" if self.verdict in NAMED else "no "
            raise UnusableInput(f"a verdict {self.verdict} has {some}findings")


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
    if path.is_dir():
        raise UnusableInput(
            f"{path} is a folder: name the verdict file in it, {path / 'verdict.json'}"
        )
    return _checked(*plain_data(path))


def parse_verdict(text: str) -> dict[str, Any]:
    """Check the text of a verdict; see `read_verdict`."""
    return _checked(*plain_data(text))


def _checked(found: Any, name: str) -> dict[str, Any]:
    try:
        data = dict(require_object(found, "the whole file", "a verdict"))
        if data.get("schema") != SCHEMA:
            raise UnusableInput(f"its schema is {str(data.get('schema', 'not given'))[:60]!r}")
        record(_Verdict, data, "", _RULES, "the verdict")
    except UnusableInput as error:
        raise UnusableInput(
            f"{name} is not a verdict of schema {SCHEMA}: {error}; write it anew with "
            "bondsight diagnose"
        ) from None
    return data


_RULES = Rules({str: any_text}, surplus=True)
