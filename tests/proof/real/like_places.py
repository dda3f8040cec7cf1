"""How much one kind explains at all like places together, and all kinds at all places at once.

Elements are alike if their names differ in digits alone: ``k_1``, ``k_2``, ``k_3``. What all forms
of all kinds leave together, along the histories of the model as it is, no place and no kind
explains.

Run: ``python -m tests.proof.real.like_places CASE``
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.kind_score import (
    Bench,
    alone,
    answers_at,
    asked_places,
    bench_of,
    forms_at,
    scored_beside,
)
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from tests.proof.real.preparing import stretches_of
from tests.proof.real.registry import chosen_cases


def like_places(names: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the names that differ in digits alone, in groups of two and more."""
    groups = defaultdict[str, list[str]](list)
    for name in names:
        groups[re.sub(r"\d+", "#", name)].append(name)
    return [tuple(g) for g in groups.values() if len(g) > 1]


def explained_together(found: Diagnosis) -> dict[tuple[tuple[str, ...], str], float]:
    """Return by places and kind the part of the misfit above the noise that all remove together.

    Forms follow the histories of the fitted model as it is; the part is of stretches left out.
    """
    fit = found.nominal
    assert fit is not None
    plain = fit.problem.with_chain
    seen, bench = scene(fit), bench_of(fit, fit, plain)
    ranked = screen(seen, probes(fit, plain), CATALOGUE)
    elements, least = bench.problem.graph.elements, alone(bench)
    columns = {
        name: dict(_of_kinds(bench, name, forms_at(seen, ranked, elements[name])))
        for name in asked_places(bench, seen)
    }

    def part(forms: Iterable[Array]) -> float:
        x = np.hstack(list(forms))
        made, _ = scored_beside(bench, np.zeros((0, x.shape[1])), x)
        return float((least.square - made.square) / (least.square - 1.0))

    everything = (x for known in columns.values() for x in known.values())
    parts: dict[tuple[tuple[str, ...], str], float] = {}
    parts[(ALL,), "all kinds"] = part(everything)
    for group in like_places(columns):
        for kind in dict.fromkeys(k for name in group for k in columns[name]):
            parts[group, kind] = part(columns[n][kind] for n in group if kind in columns[n])
    return parts


ALL = "all places at once"


def _of_kinds(
    bench: Bench, name: str, forms: Mapping[str, Signature]
) -> Iterator[tuple[str, Array]]:
    for kind, _, x in answers_at(bench, name, forms):
        yield kind, x


def main(arguments: list[str]) -> None:
    """Print the parts of each case, the largest first."""
    for case in chosen_cases(arguments):
        recording, split = case.load(None)
        stretches = stretches_of(recording)
        given = stretches[0] if len(stretches) == 1 else stretches
        found = diagnose(case.model(), given, split, model=case.name)
        for (places, kind), part in sorted(explained_together(found).items(), key=lambda p: -p[1]):
            print(f"{case.name}: {kind} at {', '.join(places)}: {100 * part:.0f} %")


if __name__ == "__main__":
    main(sys.argv[1:])
