"""An effect that a user states as a table, with a law of their own and no calculus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Law
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import Ops
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.places import mechanical_resistors
from identification.diagnosis.catalogue.site import Site, over, times
from identification.diagnosis.screening.observation import scene as scene_of
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from identification.estimation.single_record import fit
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import mechanical, response, scene


@dataclass(frozen=True)
class Thinning(Law):
    """``c w^2 f``, where ``w`` follows the flow with a time constant: paste that is stirred."""

    coefficient: float = 1.0
    tau: float = 1.0
    starts: ClassVar[tuple[str, ...]] = ("coefficient", "tau")
    name: ClassVar[str] = "thinning"
    lives_in_time: ClassVar[bool] = True
    follows: ClassVar[tuple[bool, ...]] = (False,)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        c, tau = self.coefficient, self.tau
        return (
            Parameter(f"c_t_{element}", c, "N*s3/m3", lower=0.0, scale=c),
            Parameter(f"tau_t_{element}", tau, "s", lower=0.1 * tau, upper=10.0 * tau, scale=tau),
        )

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        return (s + (memory[0] - s) * ops.exp(-p[2] / p[1]),)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        return p[0] * self.advance(ops, s, memory, p)[0] ** 2 * s


class Paste(Effect):
    name = "paste"
    family = "friction"
    kind = "dissipative"
    law = "thinning"
    sentence = "its resistance follows the square of the speed it has lately had"
    where = staticmethod(mechanical_resistors)
    weights = ("c_t",)
    shapes = over(tau=times("duration", 0.01, 0.05, 0.2))

    def made(self, at: Site, tau: float = 0.5) -> Law:
        return Thinning(0.2 * at.past.slope / at.past.rms**2, tau)


class Named(Effect):
    name = "nothing"
    where = staticmethod(mechanical_resistors)


TAU = 0.7


def test_a_table_with_an_own_law_is_found_where_it_sits() -> None:
    plain = scene("mechanical")
    graph = mechanical()
    concealed = graph.with_element("d", law=Thinning(1.0, TAU))
    clean = response(concealed, "mechanical", {"c_t_d": 0.8, "tau_t_d": TAU}, 1e-5)
    floor = 1e-3 * clean.std(axis=0)
    noise = floor * np.random.default_rng(3).standard_normal(clean.shape)
    data = replace(plain.data, readings=clean + noise, floor=floor)
    nominal = fit(Problem(graph, data), max_iterations=8)
    seen = scene_of(nominal)
    best, *others = screen(seen, probes(nominal), (*CATALOGUE, Paste()))
    assert best.label == "paste at d"
    assert best.share > 0.9
    assert best.share > others[0].share + 0.01
    assert best.hint is not None
    made = Paste().insert(seen, graph["d"], best.hint)
    assert made.graph.check() == ()
    assert made.strengths == ("c_t_d",)
    beside, alone = made.starts
    assert beside["c_t_d"] == alone["c_t_d"] == pytest.approx(0.8, rel=0.4)
    assert beside["d"] < nominal.values["d"]  # its own value had taken over a part
    assert made.graph.parameters["tau_t_d"].value == best.hint.shape["tau"]
    assert 0.3 * TAU < best.hint.shape["tau"] < 3 * TAU


def test_an_effect_without_a_law_says_what_it_lacks() -> None:
    s = scene("mechanical")
    assert Named().signatures(s, s.graph["d"]) == ()
    with pytest.raises(UnusableInput, match="effect nothing has no law: give it made"):
        Named().insert(s, s.graph["d"])
