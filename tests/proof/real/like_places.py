"""How much one kind explains at all like places together, such as the springs of three axes.

Elements are alike if their names differ in digits alone: ``k_1``, ``k_2``, ``k_3``.

Run: ``python -m tests.proof.real.like_places CASE``
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.kind_score import (
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
    parts = {}
    for group in like_places(asked_places(bench, seen)):
        by_kind = defaultdict[str, list[np.ndarray]](list)
        for name in group:
            for kind, _, x in answers_at(bench, name, forms_at(seen, ranked, elements[name])):
                by_kind[kind].append(x)
        for kind, columns in by_kind.items():
            x = np.hstack(columns)
            made, _ = scored_beside(bench, np.zeros((0, x.shape[1])), x)
            parts[group, kind] = (least.square - made.square) / (least.square - 1.0)
    return parts


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
