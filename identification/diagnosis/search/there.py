"""What a located mismatch must look like: its course, and every law and kind that may follow it.

Relations say where a mismatch sits before anything is known of its law (`places_without_name`).
With the signal that must have acted there every port's history is the true one: forms and laws of
these places are held against what was really added, and need no good guess to be seen.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Source, TwoPort, Valued
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import UNNAMED, Effect
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.catalogue.outside.external_disturbance import ExternalDisturbance
from identification.diagnosis.evidence.kind_score import (
    KindScore,
    alone,
    along,
    bench_of,
    kind_scores,
    scores_at,
)
from identification.diagnosis.evidence.remaining import loudness
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.latent_history import (
    LatentHistory,
    equal_ports,
    latent_history,
)
from identification.diagnosis.localisation.relations.latent import latent_model
from identification.diagnosis.screening.flexible_forms import FILTERS, linear_forms, rich_forms
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, screen
from identification.diagnosis.search.base import Base

FOLLOWS = 0.85
"""Part of what was added that a form of the motion explains unless it came from outside."""
ALL = 4.0
"""Times what the relation leaves that may be left where all that was added is given back."""
LOUD = 2.0
"""Times that a push from outside is stronger in the mean than half of the time."""
ALIKE = 0.3
"""Rank correlation of two signals' power from which one goes with the other."""
FEW = 30


@dataclass(frozen=True, eq=False)
class Look:
    """Laws at some places along what was added there.

    Attributes
    ----------
    scene : FittedModel
        Every port's history with what was added.
    ranking : tuple of Screened
        Laws at the places, the likeliest first.
    """

    scene: FittedModel
    ranking: tuple[Screened, ...]


@dataclass(frozen=True, eq=False)
class There:
    """How a search begins where the place is known.

    Attributes
    ----------
    base : Base
        Candidates start from the values that the relation found; those of the elements in
        question, which it does not see, stay.
    looks : tuple of Look
        One for all ports at which the same signal would have acted.
    kinds : tuple of KindScore
        At the places, best first.
    """

    base: Base
    looks: tuple[Look, ...]
    kinds: tuple[KindScore, ...]

    def likeliest(self, count: int) -> list[tuple[FittedModel, list[Screened]]]:
        """Return the likeliest laws with a name, each with the scene that it was seen in."""
        named = [
            (s, look.scene)
            for look in self.looks
            for s in look.ranking
            if s.effect.name != UNNAMED.name and s.hint is not None
        ]
        first = sorted(named, key=lambda pair: -pair[0].share)[:count]
        return [
            (look.scene, wanted)
            for look in self.looks
            if (wanted := [s for s, scene in first if scene is look.scene])
        ]


def look_there(
    base: Base,
    relations: Iterable[BlindRelation],
    where: Collection[str],
    catalogue: Sequence[Effect],
    plain: BondGraph,
    jobs: int = 1,
) -> There | None:
    """Look at the places of a located mismatch; None where what was added is not to be had.

    Parameters
    ----------
    plain : BondGraph
        The declared model: additions at ports are sent through it.
    """
    known = [r for r in relations if r.decided and r.ports[0] in where]
    relation = min(known, key=lambda r: (r.sides, r.train))
    looks: list[Look] = []
    kinds: list[KindScore] = []
    try:
        model = latent_model(probes(base.fit))
        groups = equal_ports(model, relation.ports, relation.theta)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None
    for ports in groups:
        try:
            port = next((n for n in ports if n in model.probes.ports), ports[0])
            found = latent_history(base.fit, relation, port, model)
            look, seen = _along(found, base, ports, catalogue, plain, jobs)
            if relation.sides == 1:
                seen = [*seen, *from_outside(base, found, ports, seen, relation, plain)]
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
        looks.append(look)
        kinds += seen
    if not looks:
        return None
    start = _begun(base, looks[0].scene, where)
    return There(start, tuple(looks), tuple(sorted(kinds, key=lambda k: k.score.loss)))


def _along(
    found: LatentHistory,
    base: Base,
    ports: Collection[str],
    catalogue: Sequence[Effect],
    plain: BondGraph,
    jobs: int,
) -> tuple[Look, list[KindScore]]:
    """Rank laws, and score kinds, at ports with one signal."""
    scene = _told(found, ports)
    bare = bench_of(base.fit, scene.nominal, plain)
    bench = along(bare, scene, ports)
    free = bench.columns[:, bare.columns.shape[1] :]
    ranked = screen(scene, probes(scene.nominal, plain), catalogue, jobs, free)
    here = tuple(s for s in ranked if s.element.name in ports)
    joined = [s for s in here if not (isinstance(s.element, Source) or s.effect.kind in FILTERS)]
    return Look(scene, here), kind_scores(
        bench, scene, joined, ports, jobs, rich_forms, modes=False
    )


def _told(found: LatentHistory, ports: Collection[str]) -> FittedModel:
    """Return the scene with what was added, for ports at which one signal acts alike.

    The relation is blind to these ports' own values: what other values explain is taken out.
    """
    scene = found.scene
    known = [n for n in ports if n in scene.past]
    if found.likely.shape[1] != 1 or not known:
        return scene
    rest = _beside(found.likely[:, 0], _own(scene, known))
    return replace(scene, past=scene.past | {n: replace(scene.past[n], added=rest) for n in known})


def from_outside(
    base: Base,
    found: LatentHistory,
    ports: Sequence[str],
    kinds: Sequence[KindScore],
    relation: BlindRelation,
    plain: BondGraph,
) -> list[KindScore]:
    """Return the kind ``exogenous`` where what was added follows nothing at its port.

    It is silent most of the time, though the port moves, and no form of the motion explains it.
    """
    scene, added = found.scene, found.likely[:, 0]
    known = [n for n in ports if n in scene.past]
    places = [e.name for e in ExternalDisturbance().places(scene.graph) if e.name in known]
    bench = along(bench_of(base.fit, scene.nominal, plain), scene, ports)
    if not places or not bench.probed.knows(places[0]):
        return []
    whole = scores_at(bench, places[0], {"exogenous": Signature(found.ample)})
    if not whole or whole[0].score.square > ALL * relation.train:
        return []
    most = whole[0].score
    left = min((k.score.excess(most) for k in kinds), default=np.inf)
    followed = 1.0 - left / max(alone(bench).excess(most), 1e-12)
    if followed > FOLLOWS:
        return []
    rest, motion = _beside(added, _own(scene, known)), scene.past[places[0]].argument
    if isinstance(scene.graph[places[0]], C):  # a flow shows in the effort as its integral
        rest = np.diff(rest)
        rest[[b - 1 for b in scene.data.breaks if 0 < b <= rest.size]] = 0.0
    pushes = loudness(rest)
    seldom = pushes > LOUD * max(1.0, loudness(motion))
    return whole if seldom and not grows_with(rest, [scene.past[n] for n in known]) else []


def _own(scene: FittedModel, ports: Collection[str]) -> Array:
    """Return what other values of the elements at these ports would add."""
    return np.hstack([linear_forms(scene.graph[n], scene.past[n]).columns for n in ports])


def grows_with(signal: Array, past: Iterable[PortHistory]) -> bool:
    """Whether a signal is louder where a port moves more, or less: then the motion makes it."""
    from scipy.stats import spearmanr

    histories = [
        z - z.mean()
        for p in past
        for z in (p.argument, p.rate, *((p.moved,) if p.moved is not None else ()))
    ]
    for width in (16, 64):
        own = _power(signal, width)
        if own.size < FEW:
            break
        for z in histories:
            if abs(spearmanr(own, _power(z[: signal.size], width)).statistic) > ALIKE:
                return True
    return False


def _power(signal: Array, width: int) -> Array:
    whole = signal[: signal.size // width * width]
    return np.asarray(np.mean(whole.reshape(-1, width) ** 2, axis=1))


def _beside(signal: Array, columns: Array) -> Array:
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    return np.asarray(signal - columns @ np.linalg.lstsq(columns, signal, rcond=1e-10)[0])


def _begun(base: Base, scene: FittedModel, where: Collection[str]) -> Base:
    values: Mapping[str, float] = scene.nominal.values
    graph = scene.graph
    here = [e for e in graph.of_type(Valued, TwoPort) if e.name in where and e.name in scene.past]
    own = {str(s) for e in here for s in graph.coefficient(e).free_symbols}
    starts = {n: values[n] for n in base.template.starts if n in values and n not in own}
    template = replace(base.template, starts={**base.template.starts, **starts})
    return Base(base.fit, template)
