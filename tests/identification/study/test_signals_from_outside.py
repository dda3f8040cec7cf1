"""Signals that no source makes, such as the command of a valve, are channels like any other."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, Se, Sf
from bondgraph.graph.composing.hierarchy import use
from bondgraph.graph.composing.modulated_components import MODULATED
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.datasets.opening import open_recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.localisation.structural_classes import structure
from identification.estimation import Study, Vary, estimate

FREE = ("m", "k", "d_c", "F_c_d_yield", "d_a")
UNITS = {"F": "N", "in_d_current": "A", "road": "m/s", "x": "m"}


def seat() -> BondGraph:
    """A mass on a spring and a magnetorheological damper."""
    part = MODULATED.make("magnetorheological_damper", damping=2.0, force=1.0, sensitivity=2.0)
    with BondGraph("seat") as g:
        damper, body = use(part, "d"), One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", stiffness=200.0, unit="N/m")
        body >> damper.left
        damper.right >> Sf("road", unit="m/s")
        body >> Dq("x", unit="m")
    return g


def recorded(graph: BondGraph, seed: int, n: int = 1500) -> Recording:
    rng, t = np.random.default_rng(seed), np.asarray(2e-3 * np.arange(n), float)
    turns = [2 * np.pi * f * t + rng.uniform(0, 6) for f in (0.4, 0.9, 1.7, 2.6)]
    given = {
        "F": np.sum([rng.uniform(1, 2.5) * np.sin(a) for a in turns], axis=0),
        "in_d_current": 0.5 + 0.5 * np.sin(np.pi * t),
        "road": np.zeros(n),
    }
    x = simulate(graph, t, given, hold="linear", accuracy=3e-5)["x"]
    x = x + 2e-4 * rng.standard_normal(n)
    return Recording("ridden", t, {**given, "x": x}, UNITS)


@cache
def ridden() -> Recording:
    return recorded(seat(), 0)


def test_a_damper_that_a_command_makes_yield_is_identified() -> None:
    graph = seat()
    starts = [Vary(n, start=1.05 * graph.parameters[n].value) for n in FREE]
    found = estimate(Study(graph, ridden(), starts, n_sub=8))
    for name in FREE:
        e = found.estimate_of(name)
        wide = float(np.ptp(e.ci95))
        # one of five intervals may miss the truth by a little
        assert abs(e.value - graph.parameters[name].value) < 0.75 * wide < 0.05 * e.value


def test_a_missing_channel_is_named_and_may_be_silent() -> None:
    r = ridden()
    without = Recording(
        "ridden",
        r.time,
        {n: r[n] for n in ("F", "road", "x")},
        {n: UNITS[n] for n in ("F", "road", "x")},
    )
    with pytest.raises(UnusableInput, match=r"no channel for input 'in_d_current' in ridden"):
        Study(seat(), without)
    study = Study(seat(), without, silent=("in_d_current",))
    assert not study.with_silence(without)["in_d_current"].any()


def test_a_force_of_zero_is_no_dead_channel_while_a_signal_from_outside_moves() -> None:
    r = ridden()
    still = Recording("ridden", r.time, {**r.channels, "F": np.zeros(r.n)}, UNITS)
    assert Study(seat(), still).records


def test_ports_of_a_model_with_a_jump_are_told_apart_about_its_rest() -> None:
    """No symbols for its line, but numbers: the law itself counts for nothing there."""
    found = structure(seat(), np.geomspace(1.0, 100.0, 12))
    assert {"d_c", "d_yield", "m", "k", "x"} <= set(found.class_of("k"))


def test_a_column_can_be_mapped_to_it(tmp_path: Path) -> None:
    """By its name on the command line, as a source."""
    r = ridden()
    columns = np.column_stack([r.time, r["F"], r["in_d_current"], r["road"], r["x"]])
    file = tmp_path / "ridden.csv"
    head = "t[s],F[N],coil[A],road[m/s],x[m]"
    np.savetxt(file, columns, delimiter=",", header=head, comments="")
    made, _, _ = open_recording(str(file), seat(), {"in_d_current": "coil"})
    np.testing.assert_allclose(made["in_d_current"], r["in_d_current"], atol=1e-12)
    with pytest.raises(UnknownName, match="Did you mean 'in_d_current'"):
        open_recording(str(file), seat(), {"in_d_curent": "coil"})


@pytest.mark.long
def test_a_spring_that_stiffens_is_named_beside_it() -> None:
    truth = seat().with_element("k", law=Polynomial(half=0.04, size=3.0, orders=(3,), unit="N"))
    found = diagnose(seat(), recorded(truth.with_values({"a_3_k": 3.0}), 1))
    assert [s.chosen.label for s in found.findings if s.chosen] == ["nonlinear_stiffness at k"]
    whole = diagnose(seat(), recorded(seat(), 1))
    assert whole.kind in {"explained", "parameters_only"}
