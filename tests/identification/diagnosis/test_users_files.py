"""Files of a user with one mistake each: told before any physics, with what to write instead."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bondgraph import GY, BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.signals.units import parse_unit
from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.screening.undoing import Mixup
from identification.diagnosis.screening.usual_units import named
from identification.diagnosis.screening.values_back import gives_way
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.diagnosis.verdict.text import sentence
from tests.settled import simulate

OPTIONS = DiagnosisOptions(jobs=1, keep=2, more=0, effects=1)
KNOWN = 3.0


def motor(off: float = 1.0, spread: float | None = None) -> BondGraph:
    """A DC motor, its values within 20 %, known to a factor where a spread is given."""
    with BondGraph("motor") as g:
        winding, rotor = One("winding"), One("rotor")
        Se("u", unit="V") >> winding >> R("R_w", 2.0 * off, unit="ohm", spread=spread)
        winding >> I("L_w", 5e-3 / off, unit="H", spread=spread)
        winding >> GY("K_m", ratio=0.05 * off, unit="V*s/rad", spread=spread) >> rotor
        rotor >> I("J", 1e-4 * off, unit="kg*m2", spread=spread)
        rotor >> R("b", 2e-4 * off, unit="N*m*s/rad", spread=spread)
        winding >> Df("i", unit="A")
        rotor >> Df("w", unit="rad/s")
    return g


def mass(off: float = 1.0, spread: float | None = None) -> BondGraph:
    """A mass on a spring with a damper, its place read."""
    with BondGraph("mass") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", off, unit="kg", spread=spread)
        v >> R("d", 3.0 / off, unit="N*s/m", spread=spread)
        v >> C("k", stiffness=400.0 * off, unit="N/m", spread=spread)
        v >> Dq("x", unit="m")
    return g


def tanks(off: float = 1.0, spread: float | None = None) -> BondGraph:
    """Two tanks in a row, both pressures read."""
    with BondGraph("tanks") as g:
        first, second, pipe = Zero("first"), Zero("second"), One("pipe")
        Sf("q", unit="m3/s") >> first >> C("C_1", 1e-5 * off, unit="m3/Pa", spread=spread)
        second >> C("C_2", 0.8e-5 / off, unit="m3/Pa", spread=spread)
        first >> pipe >> second
        pipe >> R("R_12", 1e7 * off, unit="Pa*s/m3", spread=spread)
        second >> R("R_out", 1.5e7 / off, unit="Pa*s/m3", spread=spread)
        first >> De("p_1", unit="Pa")
        second >> De("p_2", unit="Pa")
    return g


MODELS = {"motor": motor, "mass": mass, "tanks": tanks}
DRIVES = {"motor": ("u", 12.0, 1e-3), "mass": ("F", 10.0, 4e-3), "tanks": ("q", 1e-4, 2.0)}


@cache
def recorded(model: str) -> tuple[Array, Mapping[str, Array], Mapping[str, str]]:
    """Return time, channels with 0.5 % of noise, and their units, SI."""
    graph, (drive, size, step) = MODELS[model](1.15), DRIVES[model]
    rng = np.random.default_rng(5)
    t = np.asarray(step * np.arange(500), np.float64)
    channels = {drive: size * np.repeat(rng.uniform(-1, 1, 20), 25)}
    run = simulate(graph, t, channels, hold="hold")
    for s in graph.of_type(Sensor):
        y = np.asarray(run[s.name])
        channels[s.name] = y + 5e-3 * y.std() * rng.standard_normal(t.size)
    units = {e.name: e.unit for e in (graph[drive], *graph.of_type(Sensor))}
    return t, channels, units


def written(
    folder: Path,
    model: str,
    numbers: Mapping[str, str],
    heads: Mapping[str, str],
    columns: Mapping[str, str],
) -> Path:
    """Write a file: units that numbers are in, units that the header says, exchanged columns."""
    t, channels, units = recorded(model)
    said = {"t": "s", **units, **numbers, **heads}
    table = [t / parse_unit(numbers.get("t", "s")).scale]
    for n in channels:
        source = columns.get(n, n)
        sign, unit = (-1.0, units[source]) if numbers.get(source) == "-" else (1.0, "")
        scale = parse_unit(unit or numbers.get(source, units[source])).scale
        table.append(sign * channels[source] / scale)
    names = [f"{n}[{units[n] if said[n] == '-' else said[n]}]" for n in ("t", *channels)]
    file = folder / "run.csv"
    np.savetxt(file, np.column_stack(table), delimiter=",", header=",".join(names), comments="")
    return file


def answer(file: Path, model: str, spread: float | None) -> Diagnosis:
    return diagnose(MODELS[model](spread=spread), file, options=OPTIONS)


def slower(*case: object) -> object:
    """A case beside a quicker one of the same path."""
    return pytest.param(*case, marks=pytest.mark.long)


UNITS = [
    # the values make up for it
    ("motor", None, {"w": "rpm"}, {"w": "rad/s"}, "w looks about 9.55 times too large", "w[rpm]"),
    ("motor", None, {"w": "rad/s"}, {"w": "rpm"}, "w looks about 9.55 times too small", "w[rad/s]"),
    slower("motor", None, {"u": "mV"}, {"u": "V"}, "u looks about 1000 times too", "u[mV]"),
    ("motor", None, {"t": "ms"}, {"t": "s"}, "time looks about 1000 times too large", "t[ms]"),
    ("mass", None, {"F": "kN"}, {"F": "N"}, "F looks about 1000 times too small", "F[kN]"),
    ("tanks", None, {"q": "l/min"}, {"q": "m3/s"}, "q looks about 60000 times too", "q[l/min]"),
    slower("tanks", None, {"t": "min"}, {"t": "s"}, "time looks about 60 times too", "t[min]"),
    # bounds hold them
    slower("motor", KNOWN, {"w": "rpm"}, {"w": "rad/s"}, "w looks about 9.55 times", "w[rpm]"),
    slower("motor", KNOWN, {"i": "mA"}, {"i": "A"}, "i looks about 1000 times too", "i[mA]"),
    ("motor", KNOWN, {"t": "ms"}, {"t": "s"}, "time looks about 1000 times too", "t[ms]"),
    (
        "tanks", KNOWN, {"p_1": "bar", "p_2": "bar"}, {"p_1": "Pa", "p_2": "Pa"},
        "p_1 and p_2 look about 100000 times too small", "p_1[bar] and p_2[bar]",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("model", "spread", "numbers", "heads", "says", "mend"), UNITS)
@pytest.mark.sampled(every=2)
def test_a_wrong_unit_is_told_with_the_right_one(
    tmp_path: Path,
    model: str,
    spread: float | None,
    numbers: dict[str, str],
    heads: dict[str, str],
    says: str,
    mend: str,
) -> None:
    d = answer(written(tmp_path, model, numbers, heads, {}), model, spread)
    v = verdict(d)
    assert d.kind in ("unknown_physics", "parameters_only")
    assert any(says in s for s in v["suspects"])
    assert says in sentence(d)
    assert f"write {mend} " in d.advice[0]
    assert says in " ".join(retold(v).split())
    assert parse_verdict(json.dumps(v)) == v


EXCHANGED = [
    ("motor", KNOWN, {"i": "mA", "w": "rpm"}, ("i", "w")),
    ("motor", None, {"i": "mA"}, ("u", "i")),
    slower("motor", KNOWN, {}, ("u", "i")),
    ("mass", None, {"x": "mm"}, ("F", "x")),
    slower("tanks", None, {"q": "l/min", "p_1": "mbar"}, ("q", "p_1")),
]


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(("model", "spread", "numbers", "pair"), EXCHANGED)
def test_exchanged_columns_are_told_whatever_their_units(
    tmp_path: Path,
    model: str,
    spread: float | None,
    numbers: dict[str, str],
    pair: tuple[str, str],
) -> None:
    a, b = pair
    d = answer(written(tmp_path, model, numbers, {}, {a: b, b: a}), model, spread)
    assert d.kind == "unknown_physics"
    assert verdict(d)["suspects"][0] == f"{a} and {b} look exchanged"
    assert f"exchange the headers of {a} and {b} in the file" in d.advice[0]


@pytest.mark.parametrize("model", [slower("motor"), pytest.param("tanks", marks=pytest.mark.long)])
def test_a_sign_is_told(tmp_path: Path, model: str) -> None:
    wrong = {"motor": "w", "tanks": "p_1"}[model]
    d = answer(written(tmp_path, model, {wrong: "-"}, {}, {}), model, None)
    assert verdict(d)["suspects"] == [f"{wrong} looks recorded with the wrong sign"]


@pytest.mark.parametrize("spread", [None, KNOWN])
@pytest.mark.parametrize(
    ("model", "numbers"),
    [
        ("motor", {"i": "mA", "w": "rpm", "t": "ms"}),
        ("mass", {"x": "mm"}),
        ("tanks", {"p_1": "mbar"}),
    ],
)
@pytest.mark.sampled(every=2)
def test_a_right_file_is_suspected_of_nothing(
    tmp_path: Path, model: str, numbers: dict[str, str], spread: float | None
) -> None:
    d = answer(written(tmp_path, model, numbers, {}, {}), model, spread)
    assert d.kind in ("explained", "parameters_only")
    assert "suspects" not in verdict(d)
    assert not d.advice


def test_a_single_value_that_is_absurd_is_told(tmp_path: Path) -> None:
    """It may be its own unit as well as that of a channel: none is named."""
    graph = motor().with_element("J", value=1e-9)
    d = diagnose(graph, written(tmp_path, "motor", {}, {}, {}), options=OPTIONS)
    (told,) = verdict(d)["suspects"]
    assert told.startswith("J ends 12")
    assert "times its declared value: a unit, of a channel or of this value?" in told
    assert "J is declared as 1e-09" in sentence(d)


def test_a_recording_keeps_the_units_it_was_read_in(tmp_path: Path) -> None:
    numbers = {"i": "mA", "w": "rpm", "t": "ms"}
    r = Recording.read(written(tmp_path, "motor", numbers, {}, {}))
    assert r.read_in == {"u": "V", "i": "mA", "w": "rpm", "time": "ms"}
    assert r.select({"speed": "w"}).read_in == {"speed": "rpm", "time": "ms"}
    assert Recording.open(r.save(tmp_path / "run.npz")).read_in == r.read_in
    assert recorded_in_si().read_in == {"x": "m", "time": "s"}
    assert "read_in" not in recorded_in_si().meta


def recorded_in_si() -> Recording:
    return Recording.from_arrays("si", {"t[s]": [0.0, 1.0], "x[m]": [0.0, 1.0]})


def test_arrays_of_xarray_keep_them_too() -> None:
    xr = pytest.importorskip("xarray")
    t = xr.Variable("t", np.linspace(0.0, 90.0, 10), {"units": "ms"})
    table = xr.Dataset({"w": ("t", np.linspace(0.0, 1.0, 10), {"units": "rpm"})}, {"t": t})
    assert Recording.from_xarray(table).read_in == {"w": "rpm", "time": "ms"}


def test_a_unit_of_somebody_elses_that_is_none_counts_for_nothing() -> None:
    r = recorded_in_si()
    odd = replace(r, meta={"read_in": {"x": 5, "time": "no unit"}})
    assert odd.read_in == r.read_in


def test_energies_are_no_torques() -> None:
    assert named("J", 1e3) == ""
    assert named("N*m", 1e3) == "mN*m"
    assert named("N*m", 1.0 / 3600.0) == ""


def test_a_search_gives_way_to_values_that_are_back_closely() -> None:
    """A guess of several values may lie near some unit: then both are told."""
    close, guessed = (Mixup("scale", ("F",), 1e-3, beside=float(np.log(b))) for b in (1.2, 1.7))
    assert gives_way("missing_physics", (guessed, close))
    assert not gives_way("missing_physics", (guessed,))
    assert not gives_way("unknown_physics", (guessed,))
    assert not gives_way("parameters_only", (close,))
    assert not gives_way("missing_physics", ())


def test_what_is_missing_is_told_beside_guessed_values_near_a_unit() -> None:
    """Values guessed five to eight times too large look like pounds-force."""
    t, rng = 4e-3 * np.arange(1000), np.random.default_rng(3)
    force = 10.0 * np.repeat(rng.uniform(-1.0, 1.0, 40), 25)
    rubbing = mass().with_element("d", law=Coulomb(1.0, unit="N"))
    x = simulate(rubbing, t, {"F": force}, hold="hold")["x"]
    x = x + 2e-3 * np.std(x) * rng.standard_normal(t.size)
    guessed = mass().with_values({"m": 1.0 / 0.16, "d": 3.0 / 0.2, "k": 400.0 / 0.13})
    file = Recording.from_arrays("frame", {"t[s]": t, "F[N]": force, "x[m]": x})
    d = diagnose(guessed, file, options=OPTIONS)
    assert [m.channels for m in d.doubted] == [("F",)]
    assert d.kind == "missing_physics"
    assert {s.chosen.element for s in d.findings if s.chosen is not None} == {"d"}


def test_several_files_with_a_command_in_a_readings_column(tmp_path: Path) -> None:
    one = Recording.read(written(tmp_path, "motor", {}, {}, {"u": "i", "i": "u"}))
    half = one.n // 2
    d = diagnose(motor(spread=KNOWN), [one.slice(0, half), one.slice(half)], options=OPTIONS)
    assert verdict(d)["suspects"][0] == "u and i look exchanged"


@pytest.mark.parametrize(
    ("mistake", "friction"),
    [("sign", 9e-2), pytest.param("exchange", 5e-2, marks=pytest.mark.long)],
)
@pytest.mark.long
def test_a_mistake_is_told_beside_physics_that_is_missing(mistake: str, friction: float) -> None:
    """A motor whose friction the model leaves out: the mistake explains most, not all."""
    t = np.arange(1200) * 2e-3
    rng = np.random.default_rng(5)
    u = np.repeat(rng.uniform(-12.0, 12.0, 20), 60)
    rubbing = motor().with_element("b", law=Coulomb(friction, unit="N*m"))
    made = simulate(rubbing, t, {"u": u}, hold="hold")
    read = {n: made[n] + 5e-3 * np.std(made[n]) * rng.standard_normal(t.size) for n in ("i", "w")}
    if mistake == "sign":
        read["w"] = -read["w"]
    else:
        read = {"i": read["w"], "w": read["i"]}
    file = Recording.from_arrays(
        "drive", {"t[s]": t, "u[V]": u, "i[A]": read["i"], "w[rad/s]": read["w"]}
    )
    d = diagnose(motor(), file, options=OPTIONS)
    (told,) = verdict(d)["suspects"]
    assert told == (
        "w looks recorded with the wrong sign" if mistake == "sign" else "i and w look exchanged"
    )


def coupled(off: float = 1.0) -> BondGraph:
    """Two inertias on a stiff shaft, the speeds of both read: they differ by little."""
    with BondGraph("coupled") as g:
        first, twist, second = One("first"), Zero("twist"), One("second")
        Se("M", unit="N*m") >> first >> I("J_1", 1.5e-4 * off, unit="kg*m2")
        first >> twist >> second >> I("J_2", 1.2e-3 / off, unit="kg*m2")
        between = One("between")
        twist >> between >> C("k", stiffness=6.0 * off, unit="N*m/rad")
        between >> R("d", 4e-3, unit="N*m*s/rad")
        second >> R("b", 4e-4 * off, unit="N*m*s/rad")
        first >> Df("w_1", unit="rad/s")
        second >> Df("w_2", unit="rad/s")
    return g


def test_like_readings_are_told_though_they_differ_by_little() -> None:
    t, rng = np.arange(1200) * 2e-3, np.random.default_rng(2)
    torque = np.repeat(rng.uniform(-0.02, 0.06, 24), 50)
    made = simulate(coupled(1.05), t, {"M": torque}, hold="hold")
    read = {n: made[n] + 5e-3 * np.std(made[n]) * rng.standard_normal(t.size) for n in made.outputs}
    given = {"t[s]": t, "M[N*m]": torque}
    right = Recording.from_arrays("shaft", {**given, **{f"{n}[rad/s]": read[n] for n in read}})
    other = {"w_1[rad/s]": read["w_2"], "w_2[rad/s]": read["w_1"]}
    exchanged = Recording.from_arrays("shaft", {**given, **other})
    assert "suspects" not in verdict(diagnose(coupled(), right, options=OPTIONS))
    told = verdict(diagnose(coupled(), exchanged, options=OPTIONS))
    assert told["suspects"] == ["w_1 and w_2 look exchanged"]
