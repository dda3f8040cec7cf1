"""The judgement of one fit: numbers, and words made from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from bondgraph.support.errors import UnusableInput
from bondgraph.support.spelled import spelled
from identification.estimation.result import Estimation
from identification.estimation.single_record import Fit
from identification.estimation.starts import Starts
from identification.estimation.threads import single_threaded
from identification.statistics.criteria import Criteria, criteria
from identification.uncertainty.finding import Finding
from identification.validation.channel import ChannelJudgement, judge_channels
from identification.validation.distortion import Separated, separate
from identification.validation.remark import Remark, Weight, fault
from identification.validation.remarks import remarks
from identification.validation.source import from_estimation, from_fit
from identification.validation.tables import html_judgement, text_judgement
from identification.validation.validation_data import ValidationData


@dataclass(frozen=True, eq=False)
class Judgement:
    """What is fine about a fit, what is not, and what to try; prints as text, in notebooks as HTML.

    Attributes
    ----------
    material : ValidationData
    channels : tuple of ChannelJudgement
        One for every reading of every record.
    criteria : Criteria or None
        None where the residuals have no likelihood (nothing scored, or an exact fit).
    remarks : tuple of Remark
        Faults first.
    separated : tuple of Separated
        Noise and distortion of each record whose drive repeats.
    estimation : Estimation or None
        What was judged, if it was one.

    Examples
    --------
    >>> from bondsight import judge
    >>> judgement = judge(fit)
    >>> judgement.remarks == (), len(judgement.channels)
    (False, 1)
    """

    material: ValidationData
    channels: tuple[ChannelJudgement, ...]
    criteria: Criteria | None
    remarks: tuple[Remark, ...]
    separated: tuple[Separated, ...] = ()
    estimation: Estimation | None = None

    @property
    def fine(self) -> tuple[Remark, ...]:
        """What needs nothing."""
        return tuple(r for r in self.remarks if r.weight is Weight.FINE)

    @property
    def faults(self) -> tuple[Remark, ...]:
        """What asks for something."""
        return tuple(r for r in self.remarks if r.weight is Weight.FAULT)

    @property
    def notes(self) -> tuple[Remark, ...]:
        """What to know, without need to act."""
        return tuple(r for r in self.remarks if r.weight is Weight.NOTE)

    @property
    def leading(self) -> tuple[Remark, ...]:
        """The faults up to the one that all others most likely come of; all if there is none."""
        ends = [n for n, r in enumerate(self.faults, start=1) if r.leads]
        return self.faults[: ends[0]] if ends else self.faults

    @property
    def acceptable(self) -> bool:
        """Whether there is no fault."""
        return not self.faults

    def with_findings(self, findings: Iterable[Finding]) -> Judgement:
        """Return the judgement with what was found after the fit among its faults.

        One remark a kind; units and bounds come first, for they make all the rest.
        """
        kinds: dict[str, list[Finding]] = {}
        for f in findings:
            kinds.setdefault(f.kind, []).append(f)
        kinds.pop("not converged", None)  # a fault of its own
        if self.material.tied:  # said among the parameters
            kinds.pop("flat direction", None)
        found = {
            kind: fault(f"{every[0].said}: {'; '.join(f.what for f in every)}; {why}", every[0].do)
            for kind, every in kinds.items()
            for why in ["; ".join(dict.fromkeys(f.why for f in every))]
        }
        first = [found.pop(kind) for kind in ("unit", "at bound") if kind in found]
        pairs = [f.where for f in kinds.get("trade-off pair", ())]
        notes = (n for n in self.notes if not _told_of(n.about, pairs))
        said = (*first, *self.faults, *found.values(), *notes, *self.fine)
        return replace(self, remarks=said)

    def __str__(self) -> str:
        """Return the judgement as text."""
        return text_judgement(self)

    def __repr__(self) -> str:
        """Return one line."""
        return f"Judgement({self.material.model!r}, {len(self.faults)} faults)"

    def _repr_html_(self) -> str:
        """Return the judgement as HTML for notebooks."""
        return html_judgement(self)


def _told_of(names: tuple[str, ...], places: Iterable[str]) -> bool:
    """Whether one of the findings at these places tells how these parameters go together."""
    ends = tuple(f", {', '.join(order)}" for order in (names, names[::-1]) if names)
    return any(place.endswith(ends) for place in places)


@single_threaded
@spelled
def judge(
    fit: ValidationData | Estimation | Starts | Fit,
    *,
    kinds: Mapping[str, str] | None = None,
    starts: Sequence[float] = (),
) -> Judgement:
    """Judge a fit.

    Parameters
    ----------
    fit : Estimation, Starts, Fit or ValidationData
        What `estimate`, `many_starts` (the best of them) or a single-record `fit` returned, or
        plain arrays.
    kinds : mapping of str to str, optional
        Class of each parameter by a profile, in a word: shown beside its interval.
    starts : sequence of float, optional
        Final costs of many starts, over the noise: drawn as a waterfall.

    Returns
    -------
    Judgement

    Raises
    ------
    UnusableInput
        If no sample is scored, or the value is no fit.

    Examples
    --------
    >>> print(str(judge(fit)).splitlines()[0])
    positioner: nothing to object to
    """
    if isinstance(fit, Starts):
        starts, fit = starts or tuple(map(float, fit.costs)), fit.best
    material = material_of(fit, kinds)
    if len(starts):
        material = replace(material, starts=tuple(float(v) for v in starts))
    channels = judge_channels(material)
    if not any(c.train.n or c.test.n for c in channels):
        raise UnusableInput(f"{material.model}: no simulated sample is scored; check the splits")
    known = [v for v in (c.level for c in channels) if v is not None]
    try:
        found = criteria(known, material.n_free)
    except UnusableInput:
        found = None
    apart = tuple(s for s in map(separate, material.records) if s is not None)
    return Judgement(
        material, channels, found, remarks(material, channels, apart), apart,
        fit if isinstance(fit, Estimation) else None,
    )  # fmt: skip


def material_of(fit: object, kinds: Mapping[str, str] | None = None) -> ValidationData:
    """Return the material of anything that can be judged."""
    if isinstance(fit, ValidationData):
        return fit
    if isinstance(fit, Estimation):
        return from_estimation(fit, kinds)
    if isinstance(fit, Fit):
        return from_fit(fit)
    raise UnusableInput(f"{type(fit).__name__} is no fit; judge what estimate() or fit() returned")
