"""Scenes, screenings, kinds and places of the fits that a search has looked at, made once each."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np
from joblib import delayed, effective_n_jobs

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.support.errors import BondsightError
from bondgraph.support.parallel import results
from identification.diagnosis.catalogue import Effect
from identification.diagnosis.evidence.kind_pairs import KindPair, pair_scores
from identification.diagnosis.evidence.kind_score import KindScore, bench_of, kind_scores
from identification.diagnosis.localisation.blind_relations import BlindRelation, blind_relations
from identification.diagnosis.localisation.places_without_name import located
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, screen
from identification.diagnosis.search.base import Base
from identification.diagnosis.search.there import There, look_there
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm


class Looks:
    """Scenes, screenings and kinds made so far: what is left beside a repair starts the next step.

    Parameters
    ----------
    plain : BondGraph
        The declared model: additions at ports are sent through it.
    jobs : int
        Threads.
    """

    def __init__(self, catalogue: tuple[Effect, ...], plain: BondGraph, jobs: int = 1) -> None:
        self.catalogue, self.plain, self.jobs = catalogue, plain, jobs
        self.known: dict[int, tuple[Fit, FittedModel, list[Screened]]] = {}
        self.blind: tuple[BlindRelation, ...] = ()
        self.coming: Iterator[tuple[BlindRelation, ...]] | None = None

    def of(self, fit: Fit) -> tuple[FittedModel, list[Screened]]:
        """Scene and ranking of one fit."""
        if id(fit) not in self.known:
            seen = scene(fit)
            looks = screen(seen, probes(fit, self.plain), self.catalogue, self.jobs)
            self.known[id(fit)] = (fit, seen, looks)
        return self.known[id(fit)][1:]

    def looked(self, fit: Fit) -> tuple[FittedModel | None, list[Screened]]:
        """Scene and ranking of one fit if they were made; no more is looked at."""
        return self.known[id(fit)][1:] if id(fit) in self.known else (None, [])

    def ask_where(self, base: Fit, classes: Isolability) -> None:
        """Let a process of its own look for the relations that `where` will need."""
        if effective_n_jobs(self.jobs) > 1:
            work = [delayed(_relations)(base, classes)]
            self.coming = results(work, self.jobs)

    def where(self, base: Fit, classes: Isolability) -> tuple[str, ...]:
        """Return the only places where the mismatch may sit, whatever its law."""
        coming, self.coming = self.coming, None
        try:
            self.blind = _relations(base, classes) if coming is None else next(coming)
        except RuntimeError:  # other work that was ended early took the processes along
            self.blind = _relations(base, classes)
        return located(self.blind, base.problem.data.names)

    def there(self, base: Base, where: Collection[str]) -> There | None:
        """Look at the only places where the mismatch may sit."""
        return look_there(base, self.blind, where, self.catalogue, self.plain, self.jobs)

    def kinds(
        self, base: Fit, better: Fit, places: Collection[str] | None = None
    ) -> list[KindScore]:
        """Score every kind at every port, on top of `base`, along the histories of `better`."""
        try:
            bench = bench_of(base, better, self.plain)
            return kind_scores(bench, *self.of(better), places, jobs=self.jobs)
        except BondsightError:
            return []

    def pairs(self, base: Fit, better: Fit, asked: Sequence[KindScore]) -> list[KindPair]:
        """Score every kind in question beside every other one, along the histories of `better`."""
        try:
            bench = bench_of(base, better, self.plain)
            return pair_scores(bench, *self.of(better), asked, jobs=self.jobs)
        except BondsightError:
            return []


@calm()
def _relations(base: Fit, classes: Isolability) -> tuple[BlindRelation, ...]:
    """Relations blind to every place; models that are not linear up to laws have none."""
    try:
        return blind_relations(base, classes)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return ()
