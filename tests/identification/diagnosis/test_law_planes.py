"""Curves of found laws where no exact step runs the model, and of iron that saturates."""

from __future__ import annotations

import base64
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph import MTF, BondGraph, C, De, Df, Dq, I, One, R, Reading, Se, Zero, effort
from bondgraph.graph.drives import Drive
from bondgraph.graph.modulation import displacement
from bondgraph.laws import DeadZone, Law, Overflow, Polynomial, SaturatingInductance
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.law import LawPath, law_ports, path
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.studio import law_plane
from identification.diagnosis.studio.law_plane import planes
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate

T = np.asarray(0.01 * np.arange(400), np.float64)
U = 4 * np.sin(2 * np.pi * 0.7 * T) + 2 * np.sin(2 * np.pi * 2.3 * T)


def lever(
    law: Law | None = None, friction: Law | None = None, backwards: bool = False
) -> BondGraph:
    """A graph that is not linear up to laws."""
    with BondGraph("lever") as g:
        body, inner = One("body"), One("inner")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        d = R("d", 2.0, unit="N*s/m", law=friction)
        if backwards:
            d >> body
        else:
            body >> d
        body >> C("k", stiffness=200.0, unit="N/m", law=law)
        body >> MTF("arm", ratio=20.0 * displacement("k")) >> inner
        inner >> C("c", stiffness=30.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def coil(law: Law | None = None) -> BondGraph:
    with BondGraph("coil") as g:
        loop = One("loop")
        Se("F", unit="V") >> loop >> I("L", 0.5, unit="H", law=law)
        loop >> R("R", 2.0, unit="ohm")
        loop >> Df("x", unit="A")
    return g


def fitted(graph: BondGraph, truth: BondGraph, steps: int) -> tuple[Fit, Array]:
    """A fit to a simulated record, and the reading."""
    x = np.asarray(simulate(truth, T, {"F": U})["x"])
    x = x + 1e-4 * x.std() * np.random.default_rng(0).standard_normal(T.size)
    split = Split(slice(0, 300), slice(300, T.size), "first part")
    data = Data("run", T, {"F": U}, x[:, None], ("x",), np.array([1e-4 * x.std()]), split)
    return fit(Problem(graph, data), max_iterations=steps), x


def tried(made: Fit, element: str) -> Any:
    """A candidate as far as planes ask it."""
    label = f"nonlinear_stiffness at {element}"
    brought = SimpleNamespace(plain=False)
    return SimpleNamespace(
        fit=made, element=element, label=label, effect="nonlinear_stiffness", test=1.0,
        insertion=brought,
    )  # fmt: skip


def test_a_law_in_a_general_graph_has_its_path() -> None:
    truth = lever(Polynomial(0.0, 0.02, unit="N")).with_values({"a_3_k": 3.0})
    made, x = fitted(truth, truth, 1)
    assert law_ports(made) == []
    run = path(tried(made, "k"))
    assert run is not None
    assert (run.argument_unit, run.output_unit) == ("m", "N")
    assert np.abs(run.argument - x[: run.argument.size]).max() < 0.02 * np.ptp(x)
    value = made.values["a_2_k"] * (run.argument / 0.02) ** 2
    value = value + made.values["a_3_k"] * (run.argument / 0.02) ** 3
    np.testing.assert_allclose(run.deviation, value, atol=1e-6 * np.ptp(value))


def test_iron_that_saturates_bends_current_over_flux_linkage() -> None:
    truth = coil(SaturatingInductance(0.5, 0.25))
    nominal, x = fitted(coil(), truth, 20)
    made, _ = fitted(truth, truth, 1)
    one = tried(made, "L")
    step: Any = SimpleNamespace(possible=(one,), same_place=(), kind="missing_physics", chosen=one)
    run = Recording("run", T, {"F": U, "x": x}, {"F": "V", "x": "A"})
    seen = scene(nominal)
    d = Diagnosis(
        "missing_physics", "coil", run, coil(), nominal.problem.data, nominal=nominal, scene=seen,
        steps=(step,), trials=(one,),
    )  # fmt: skip
    plane = planes(d)["of"]["L"]
    assert plane["xLabel"].startswith("flux linkage of L (")
    assert plane["yLabel"].startswith("current (")
    (law,) = plane["laws"]
    assert law["on"]
    psi, current = (np.frombuffer(base64.b64decode(plane[k]), "<f4") for k in "xy")
    flux, i = (np.frombuffer(base64.b64decode(law[k]), "<f4") for k in "xy")
    # the law and the recovered points bend alike, and away from the nominal straight line
    at = np.interp(current, i, flux)
    straight = np.polyval(np.polyfit(current, at, 1), current)
    assert np.std(psi - at) < 0.2 * np.std(at - straight)


def charged(law: Law | None = None) -> BondGraph:
    """A capacitor behind a resistor: its voltage is read, its charge is not."""
    with BondGraph("charged") as g:
        loop, node = One("loop"), Zero("node")
        Se("F", unit="V") >> loop >> R("r", 1.0, unit="ohm")
        loop >> node >> C("c", 0.2, unit="F", law=law)
        node >> R("load", 5.0, unit="ohm")
        node >> De("x", unit="V")
    return g


def plane_of_charge(nominal: Fit, made: Fit) -> dict[str, Any]:
    """Return the plane of the capacitor where its law was named."""
    return plane_of(nominal, made, "c")


def plane_of(
    nominal: Fit, made: Fit, at: str, kind: str = "missing_physics", named: str = "c"
) -> dict[str, Any]:
    """Return the plane of an element where the law of `named` was named, or not."""
    one, graph = tried(made, named), nominal.problem.graph
    step: Any = SimpleNamespace(possible=(one,), same_place=(), kind=kind, chosen=one)
    data = nominal.problem.data
    seen = {"F": U, **dict(zip(data.names, data.readings.T, strict=True))}
    run = Recording("run", T, seen, dict.fromkeys(seen, "1"))
    d = Diagnosis(
        kind, graph.name, run, graph, nominal.problem.data, nominal=nominal,
        scene=scene(nominal), steps=(step,), trials=(one,),
    )  # fmt: skip
    plane: dict[str, Any] = planes(d)["of"][at]
    return plane


def test_where_a_reading_tells_the_effort_of_a_store_points_draw_no_loops() -> None:
    """Beside its own bent resistances the model as it is has another charge than the plant."""
    truth = charged(Polynomial(0.0, 0.4, orders=(3,), unit="V")).with_values({"a_3_c": 1.0})
    (nominal, _), (made, _) = fitted(charged(), truth, 20), fitted(truth, truth, 20)
    plane = plane_of_charge(nominal, made)
    assert plane["open"] == law_plane.REPAIRED
    (law,) = plane["laws"]
    x, y, q, v = (
        np.frombuffer(base64.b64decode(p[k]), "<f4").astype(float)
        for p, k in ((plane, "x"), (plane, "y"), (law, "x"), (law, "y"))
    )
    at = np.interp(x, q, v)
    bend = np.std(at - np.polyval(np.polyfit(x, at, 1), x))
    assert np.std(y - at) < 0.1 * bend


def winding(*, backwards: bool, law: Law | None = None, iron: Law | None = None) -> BondGraph:
    """A coil and its resistance, their bonds drawn the usual way or out of them."""
    with BondGraph("winding") as g:
        loop = One("loop")
        Se("F", unit="V") >> loop
        for e in (I("L", 0.5, unit="H", law=iron), R("c", 2.0, unit="ohm", law=law)):
            if backwards:
                e >> loop
            else:
                loop >> e
        loop >> Df("x", unit="A")
    return g


@pytest.mark.parametrize("named", ["missing_physics", "unknown_physics"])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_plane_is_not_mirrored_by_the_way_a_bond_is_drawn(backwards: bool, named: str) -> None:
    """Points of a resistor whose bond points out of it lay across its law."""
    law = Polynomial(0.0, 1.0, orders=(3,), unit="V")
    truth = winding(backwards=backwards, law=law).with_values({"a_3_c": 0.6})
    nominal, _ = fitted(winding(backwards=backwards), truth, 20)
    made, _ = fitted(truth, truth, 5)
    plane = plane_of(nominal, made, "c", named)
    x, y, i, v = (
        np.frombuffer(base64.b64decode(s), "<f4")
        for s in (plane["x"], plane["y"], *(plane["laws"][0][k] for k in "xy"))
    )
    order = np.argsort(i)
    assert np.median(np.abs(y - np.interp(x, i[order], v[order]))) < 0.01 * np.ptp(v)
    assert np.corrcoef(x, y)[0, 1] > 0.9
    coil = plane_of(nominal, made, "L", named)
    psi, current = (np.frombuffer(base64.b64decode(coil["nominal"][s]), "<f4") for s in "xy")
    assert np.corrcoef(psi, current)[0, 1] > 0.9


def test_a_law_of_a_drive_lies_on_its_points() -> None:
    """Of a slope that values take over in part the points had lost that part: its law lay off."""
    with BondGraph("gauge") as plain:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m")
        body >> Df("v", unit="m/s")
        Reading("f", effort("k") + effort("d"), unit="N")
    idle = plain.with_element("F", drive=Drive(law=DeadZone(0.0, 0.5, 6.0, "N")))
    run = simulate(idle, T, {"F": U})
    y = np.stack([np.asarray(run[n]) for n in ("v", "f")], axis=1)
    noise = 1e-3 * y.std(axis=0)
    y = y + noise * np.random.default_rng(0).standard_normal(y.shape)
    split = Split(slice(0, 300), slice(300, T.size), "first part")
    data = Data("run", T, {"F": U}, y, ("v", "f"), noise, split)
    nominal = fit(Problem(plain, data), max_iterations=20)
    plane = plane_of(nominal, fit(Problem(idle, data), max_iterations=5), "F", named="F")
    x, out, s, w = (
        np.frombuffer(base64.b64decode(v), "<f4").astype(float)
        for v in (plane["x"], plane["y"], plane["laws"][0]["x"], plane["laws"][0]["y"])
    )
    order = np.argsort(s)
    law = np.interp(x, s[order], w[order])
    assert abs(np.polyfit(x, out - law, 1)[0]) < 0.005


def test_a_law_in_a_general_graph_does_not_mind_the_way_of_its_bond() -> None:
    seen = []
    for backwards in (False, True):
        truth = lever(friction=Polynomial(0.0, 1.0, orders=(3,), unit="N"), backwards=backwards)
        made, _ = fitted(truth, truth, 1)
        run = path(tried(made, "d"))
        assert run is not None
        seen.append((run.argument, run.deviation))
    for one, other in zip(*seen, strict=True):  # into the element it flows the other way
        np.testing.assert_allclose(one, -other, atol=1e-6 * np.ptp(one))


def test_a_store_with_a_rim_counts_what_it_spilled() -> None:
    rim = Overflow(stiffness=5.0, stiffness_unit="V/C", depth=0.3, size=0.3, top=0.6, unit="C")
    truth = charged(rim)
    (nominal, _), (made, _) = fitted(charged(), truth, 5), fitted(truth, truth, 1)
    assert plane_of_charge(nominal, made)["open"].endswith(law_plane.SPILLED)


def test_a_law_lies_on_points_whose_level_and_scale_nobody_knows(monkeypatch: Any) -> None:
    """The fit of the law has a charge of its own: its loop hung far below the points."""
    q = np.sin(2 * np.pi * 0.7 * T) + 0.5 * np.sin(2 * np.pi * 2.3 * T)
    points = (T, q, 30.0 * q + 0.2 * q**3)
    own = 0.3 + 1.2 * q  # as another resistance and another initial state make it
    run = LawPath(T, own, 0.2 * q**3 + 7.0, 25.0, "C", "V", "charge", "voltage")
    monkeypatch.setattr(law_plane, "path", lambda trial: run)
    trial: Any = SimpleNamespace(
        element="C", test=1.0, label="hysteresis at C", effect="hysteresis"
    )
    d: Any = SimpleNamespace(
        steps=[SimpleNamespace(possible=(trial,), same_place=())], trials=(), graph={"C": None}
    )
    ((_, _, x, y),) = law_plane._laws(d, "C", points, (0, 1), 10**6)
    assert np.interp(x, np.sort(q), points[2][np.argsort(q)]) == pytest.approx(y, abs=1e-6)
