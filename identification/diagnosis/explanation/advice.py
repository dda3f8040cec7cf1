"""What to record next, computed from the structure and from the rivals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.graph.elements import Element, Se, Source
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.outside.external_disturbance import ExternalDisturbance
from identification.diagnosis.catalogue.places import has_unit
from identification.diagnosis.catalogue.storage.leakage import Leakage
from identification.diagnosis.explanation.common_lag import lag_of_all
from identification.diagnosis.explanation.doubts import file_first
from identification.diagnosis.explanation.next_step import junction_signal, next_step
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.localisation.structural_classes import splitting_signals
from identification.report.numbers import interval, unit_of_level
from identification.report.words import listed

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis


INCOMPLETE = "the repaired model is better, not complete"
"""How advice begins where a repair leaves more than noise."""
ANYTHING = (
    "no effect of the catalogue fits: record a slow large sweep and a step with a rest after it",
)
"""What helps where nothing at all is known of what is missing."""


def advice(d: Diagnosis, frequencies: Array) -> tuple[str, ...]:
    """Return what to record next, computed from the structure, after what to mend."""
    instead = [w.advice for w in (d.load, lag_of_all(d)) if w is not None]
    known = (*_surroundings(d), *_to_record(d, frequencies), *_incomplete(d))
    said = (*file_first(d), *instead, *known)
    if said or d.kind != "unknown_physics":
        return said
    beyond = _beyond_training(d)
    return (beyond,) if beyond else next_step(d) or ANYTHING


def _surroundings(d: Diagnosis) -> Iterator[str]:
    """Yield that what seems to heat a store may be an ambient temperature that nobody recorded."""
    steps = d.findings if d.findings or d.decision is None else (d.decision,)
    pushed = [
        t.element for s in steps for t in s.possible
        if t.effect == ExternalDisturbance.name
        and t.element in d.graph.elements and _warm(d.graph[t.element])
    ]  # fmt: skip
    known = any(has_unit(s, ("K",)) for s in d.graph.of_type(Se) if s.name in d.recording.channels)
    if pushed and not known:
        stores = listed(dict.fromkeys(pushed))
        yield (
            f"if the ambient temperature moved meanwhile, that is what acts on {stores}: record "
            "it, and put it behind the resistors to the ambient as a source (Se, K)"
        )


def _warm(store: Element) -> bool:
    return variables_of(store).effort == "temperature"


def _to_record(d: Diagnosis, frequencies: Array) -> tuple[str, ...]:
    if d.decision is None or d.decision.chosen is None or d.scene is None or d.structure is None:
        return ()
    chosen, lines = d.decision.chosen, list[str]()
    same = list(dict.fromkeys(t.element for t in d.decision.same_place))
    apart = splitting_signals(d.scene.fitted, chosen.element, same, frequencies)
    for signal, _, split in apart[:1]:
        lines.append(
            f"record {junction_signal(d.scene.graph, signal)}: it separates {chosen.element} from "
            f"{', '.join(split)}"
        )
    for name in same:
        source = d.graph[name]
        if isinstance(source, Source) and not source.measured:
            lines.append(
                f"record what {name} really puts out beside its command: it separates "
                f"{chosen.element} from {name}"
            )
    lines += [e.sentence for e in d.experiments[:2]]
    return tuple(lines)


def _incomplete(d: Diagnosis) -> Iterator[str]:
    """Yield that a repaired model leaves more than noise."""
    if d.kind == "missing_physics" and d.left is not None and not d.left.is_noise(d.limits.noise):
        losing = [t.element for s in d.findings for t in s.possible if t.effect == Leakage.name]
        for name in losing:
            if _warm(d.graph[name]):
                yield (
                    f"declare a resistor from {name} to the ambient and diagnose again: then the "
                    "law of that loss can be told, such as radiation or free convection"
                )
        yield (
            f"{INCOMPLETE}: it leaves {d.left.most:.3g} times the "
            "noise; record another amplitude, another speed, a rest after a step, and diagnose "
            "all recordings together"
        )


def _beyond_training(d: Diagnosis) -> str:
    """Word when the held-out commands leave the range of the training part."""
    if d.data is None or d.nominal is None:
        return ""
    for n, u in d.data.commands.items():
        train, test = u[d.data.mask("train")], u[d.data.mask("test")]
        margin = 0.05 * float(np.ptp(train))
        if test.min() < train.min() - margin or test.max() > train.max() + margin:
            unit = d.recording.units.get(n) or ""
            unit = unit_of_level(unit, d.recording.read_in.get(n, ""))
            return (
                f"{n} goes over {interval(test.min(), test.max(), unit)} in the held-out part but "
                f"only over {interval(train.min(), train.max(), unit)} in training: record the "
                "whole range in both"
            )
    return ""
