"""Parameters that a recording tells only together: as their sum, their product or the like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.report.numbers import interval, quantity
from identification.report.words import listed
from identification.uncertainty.combinations import Combination, FlatBlock
from identification.uncertainty.fitted import FitView
from identification.uncertainty.information import Information
from identification.uncertainty.postflight import practical_of
from identification.uncertainty.practical import Practical
from identification.uncertainty.weighted_sums import WeightedSum, weighted_sum

ANYTHING = 1e9
"""Upper end over the lower one from which an interval tells nothing."""


@dataclass(frozen=True, slots=True)
class Told:
    """A combination that is determined, with its 95 % interval, SI.

    Attributes
    ----------
    text : str
        Such as ``b_m + b_f``.
    """

    text: str
    value: float
    unit: str
    ci95: tuple[float, float]

    @property
    def document(self) -> dict[str, Any]:
        """Plain data; null for what is not finite."""
        value, *ends = (float(v) if np.isfinite(v) else None for v in (self.value, *self.ci95))
        return {"text": self.text, "value": value, "unit": self.unit, "ci95": ends}

    def __str__(self) -> str:
        """Name, number and interval."""
        low, high = self.ci95
        if low > 0.0 and high > ANYTHING * low:
            return f"{self.text}, which is not determined either"
        ends = interval(low, high, self.unit, self.value)
        return f"{self.text} = {quantity(self.value, self.unit)}, 95 %: {ends}"


@dataclass(frozen=True, slots=True)
class Tied:
    """Parameters that no sample tells one by one, and what is told instead.

    Attributes
    ----------
    names : tuple of str
    form : str
        What is told, in words, such as ``their sum``.
    told : tuple of Told
        Empty where no short combination was found.
    missing : int
        How many of them must be fixed to determine the others.
    """

    names: tuple[str, ...]
    form: str
    told: tuple[Told, ...]
    missing: int = 1

    @property
    def only(self) -> str:
        """What is determined, in symbols; empty where that is not short."""
        return ", ".join(t.text for t in self.told)

    @property
    def remark(self) -> str:
        """What stands beside each of the parameters instead of an interval."""
        return f"only {self.only} is determined" if self._whole else "not determined by itself"

    @property
    def _whole(self) -> bool:
        """Whether all that is told of them is in `told`."""
        return len(self.told) == len(self.names) - self.missing

    @property
    def document(self) -> dict[str, Any]:
        """Plain data, as a verdict and the values of a fit have it."""
        told = [t.document for t in self.told]
        return {"names": list(self.names), "words": self.words, "told": told}

    @property
    def words(self) -> str:
        """One sentence without its beginning: the recording tells ..."""
        if not self.told:
            return f"{listed(self.names)} only in combinations that are no short sum or product"
        more = "" if self._whole else ", and by others that are no short sum or product"
        return f"{listed(self.names)} only as {self.form}: {'; '.join(map(str, self.told))}{more}"


def tied(
    view: FitView, before: FitView | None = None, pinned: Sequence[FlatBlock] = ()
) -> tuple[Tied, ...]:
    """Return the parameters of a fit that are told only together; empty where it cannot be said.

    What a fit without a law told only together stays so beside one whose constants nobody fitted,
    such as thresholds: they set a scale that no sample tells. `before` is that fit; `pinned` are
    such groups where the structure of the model tells them (`uncertainty.pinned`).

    Bounds count for nothing: where one stops a parameter, the others only seem to be determined.
    Nor does how little a part of a sum that ended small moves the readings: it is looked at where
    no part has vanished.
    """
    try:
        with np.errstate(all="ignore"):
            seen = view.restored()
            known = _loose(seen)
            here = known if seen is view else _loose(view)
            blocks = pinned if before is None else _loose(before.restored()).flat
    except (BondsightError, np.linalg.LinAlgError):
        return ()
    open_here = [set(b.names) for b in here.flat if len(b.names) > 1]
    found = ((b, _tied(b, view, here.information)) for b in known.flat if len(b.names) > 1)
    # where a knee became a bend much else is open that is told well beside the knee: only a sum is
    # one wherever its parts are
    own = tuple(
        t for b, t in found
        if "sum" in t.form or any(names <= set(b.names) for names in open_here)
    )  # fmt: skip
    named = {n for t in own for n in t.names}
    free = set(view.sensitivities.names) - named
    kept = (b for b in blocks if len(b.names) > 1 and set(b.names) <= free)
    return (*own, *(_tied(b, view, here.information) for b in kept))


def _loose(view: FitView) -> Practical:
    open_ended = tuple(replace(u, lower=-np.inf, upper=np.inf) for u in view.parameters)
    return practical_of(replace(view, parameters=open_ended), dead=0.0)


def _tied(b: FlatBlock, view: FitView, info: Information) -> Tied:
    known = view.known
    if not b.determined and b.at:
        points = [replace(p, values={**p.values, **known}) for p in b.at]
        declared = view.stack.problems[0].graph.parameters
        units = {n: declared[n].unit for n in known} | _units(info)
        found = weighted_sum(b.names, points, units)
        if found is not None:
            return Tied(b.names, "a weighted sum", (_told(found, info, known),), b.missing)
    told = tuple(_told(c, info, known) for c in b.determined)
    return Tied(b.names, _form(b), told, b.missing)


def remark_on(name: str, found: Sequence[Tied]) -> str:
    """Return what stands beside a parameter instead of its interval; empty where it has one."""
    return next((t.remark for t in found if name in t.names), "")


_FORMS = {
    ("sum", 1): "their sum", ("sum", -1): "their difference",
    ("product", 1): "their product", ("product", -1): "their ratio",
    ("sum of reciprocals", 1): "the sum of their reciprocals",
    ("sum of reciprocals", -1): "the difference of their reciprocals",
}  # fmt: skip


def _form(b: FlatBlock) -> str:
    """Say what is told where all parameters take part in one plain combination."""
    if len(b.determined) != 1 or set(b.determined[0].names) != set(b.names):
        return "combinations"
    c = b.determined[0]
    signs = {1} if set(c.weights) == {1} else {-1} if sorted(c.weights) == [-1, 1] else set()
    return next((_FORMS[c.form, s] for s in signs), "a combination")


def _told(c: Combination | WeightedSum, info: Information, known: Mapping[str, float]) -> Told:
    s = info.sensitivities
    values = {**known, **dict(zip(s.names, s.values.tolist(), strict=True))}
    gradient = c.gradient(values, dict(zip(s.names, s.slopes.tolist(), strict=True)))
    reach = 1.96 * info.error_of(np.array([gradient.get(n, 0.0) for n in s.names]))
    v = c.value(values)
    ends = (v - reach, v + reach)
    if c.form == "product":
        low, high = sorted(v * np.exp(e) for e in np.clip((-reach, reach), -700.0, 700.0))
        ends = (float(low), float(high))
    return Told(str(c), v, c.unit(_units(info)), ends)


def _units(info: Information) -> dict[str, str]:
    return dict(zip(info.sensitivities.names, info.sensitivities.units, strict=True))
