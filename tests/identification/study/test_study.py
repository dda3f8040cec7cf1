"""A study checks what it can before a simulation, and keeps what it was given."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from bondgraph import BondGraph, I, One, Se
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.estimation import LogNormal, Nuisances, Study, Vary, estimate
from identification.study.data import data_for
from tests.identification.estimation.plants import record, spring, study


def test_free_parameters_are_all_that_are_not_fixed() -> None:
    assert Study(spring(), record(60)).free_names == ("m", "d", "k")
    assert Study(spring(), record(60), fixed={"d": 3.0}).free_names == ("m", "k")
    declared = spring().with_element("k", stiffness="stiff")
    declared = declared.with_parameters([Parameter("stiff", 200.0, "N/m", fixed=True)])
    assert "stiff" not in Study(declared, record(60)).free_names
    assert Study(declared, record(60), free=("stiff",)).free_names == ("stiff",)
    assert Study(spring(), record(60), free=()).free == ()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"free": ("mm",)}, "no free parameter 'mm' in spring. Did you mean 'm'"),
        ({"fixed": {"dd": 1.0}}, "no parameter 'dd' in spring. Did you mean 'd'"),
        ({"hold": "lineer"}, "Did you mean 'linear'"),
        ({"noise": "colored"}, "Did you mean 'coloured'"),
        ({"noise": {"y": 1.0}}, "no sensor 'y'"),
        ({"initial": "fre"}, "Did you mean 'free'"),
        ({"silent": ("G",)}, "no source 'G'"),
    ],
)
def test_unknown_names_are_errors_with_the_nearest(options: dict[str, object], words: str) -> None:
    with pytest.raises(UnknownName, match=words.replace(".", r"\.")):
        study(record(60), **options)


def test_unknown_state_is_an_error() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'q_k'"):
        estimate(study(record(60), initial={"q_x": 0.0}))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"free": "m"}, "give a sequence of names"),
        ({"noise": {"x": np.full(60, np.nan)}}, r"a deviation for every sample \(60\)"),
        ({"noise": {"x": (1.0, 2.0)}}, "2 deviations for 1 recordings"),
        ({"noise": {"x": np.nan}}, "give a positive deviation"),
        ({"noise": {"x": "loud"}}, "give a deviation"),
        ({"free": ("m", "m")}, "free twice"),
        ({"free": (3,)}, "give its name or a Vary"),
        ({"free": ("m",), "fixed": {"m": 1.0}}, "free and as fixed"),
        ({"free": ("m",), "fixed": {"k": float("nan")}}, "not a finite number"),
        ({"free": ("m",), "fixed": {"k": -5.0}}, "must be positive"),
        ({"free": (Vary("k", start=-5.0),)}, "must be positive"),
        ({"free": (Vary("k", lower=900.0),)}, "outside of its bounds 900 to inf"),
        ({"noise": {"x": 0.0}}, "positive deviation"),
        ({"noise": {"x": float("inf")}}, "positive deviation"),
        ({"window": 2}, "window = 2"),
        ({"window": 60.5}, "whole number"),
        ({"n_sub": 0}, "n_sub = 0"),
        ({"n_sub": 1.5}, "whole number"),
        ({"init": -1}, "init = -1"),
        ({"init": 1}, "init = 1"),
        ({"init": 60, "validation": record(60, name="v")}, "nothing to judge of 'v'"),
    ],
)
def test_values_that_mean_nothing_are_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        study(record(60), **options)


@pytest.mark.parametrize(
    ("train", "test", "words"),
    [
        (slice(0, 5000), slice(0, 0), "sample 5000 lies outside of the 60 samples"),
        (slice(0, 40), slice(-80, None), "sample -80"),
        (slice(0, 40), slice(20, 60), "20 samples are in train and in test"),
        (slice(0, 40, 2), slice(40, 60), "step 2"),
        (slice(10, 10), slice(40, 60), "no training sample"),
        (slice(40, 10), slice(40, 60), "no training sample"),
    ],
)
def test_splits_that_do_not_exist_are_refused(train: slice, test: slice, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        study(record(60), splits=Split(train, test, "odd"))


def test_splits_count_from_the_end_too_and_fit_the_records() -> None:
    made = study(record(60), splits=Split(slice(None, -20), slice(-20, None), "last"))
    assert made.splits[0].train == slice(0, 40)
    assert made.splits[0].test == slice(40, 60)
    with pytest.raises(UnusableInput, match="2 splits for 1 recordings"):
        study(record(60), splits=[made.splits[0]] * 2)


@pytest.mark.parametrize("bad", ["abc", np.zeros(3), [None]])
def test_what_is_no_recording_is_refused(bad: object) -> None:
    with pytest.raises(UnusableInput, match="a study takes recordings, not"):
        Study(spring(), bad)  # type: ignore[arg-type]


def test_missing_recordings_channels_and_sensors() -> None:
    with pytest.raises(UnusableInput, match="no recording to fit"):
        Study(spring(), [])
    made = record(60)
    bare = Recording.from_arrays("bare", {"x[m]": made["x"]}, fs=100.0)
    with pytest.raises(UnusableInput, match="silent=\\('F',\\) is 0"):
        Study(spring(), bare)
    deaf = Recording.from_arrays("deaf", {"F[N]": made["F"]}, fs=100.0)
    with pytest.raises(UnusableInput, match="none of the sensors 'x' of spring"):
        Study(spring(), deaf)
    with BondGraph("blind") as g:
        Se("F", unit="N") >> One("v") >> I("m", 1.0, unit="kg")
    with pytest.raises(UnusableInput, match="no sensor"):
        Study(g, made)


@pytest.mark.parametrize(("names", "other"), [(("force", "x"), "F"), (("F", "place"), "x")])
def test_the_only_channel_in_a_unit_is_told_with_what_to_write(
    names: tuple[str, str], other: str
) -> None:
    made = record(60)
    arrays = {f"{names[0]}[N]": made["F"], f"{names[1]}[m]": made["x"]}
    given = Recording.from_arrays("given", arrays, fs=100.0)
    with pytest.raises(UnusableInput, match=r"is the only one in .+: give recording\.select") as no:
        Study(spring(), given)
    called = next(n for n in names if n not in ("F", "x"))
    table = {other: called, "*": "*"}
    assert f"recording.select({table!r})" in str(no.value)
    assert Study(spring(), given.select(table)).records[0].channels.keys() == {"F", "x"}


def test_data_say_the_same_of_the_only_channel_in_a_unit() -> None:
    """In the words of Python: who comes from the command line has it matched already."""
    read = record(60).select({"push": "F", "x": "x"})
    split = Split(slice(0, 60), slice(60, 60), "all")
    with pytest.raises(UnusableInput, match=r"push is the only one in N: give recording\.select"):
        data_for(spring(), read, split, {"x": 1.0})


def test_unit_of_another_dimension_is_refused() -> None:
    made = record(60)
    volts = Recording.from_arrays("volts", {"F[V]": made["F"], "x[m]": made["x"]}, fs=100.0)
    with pytest.raises(UnusableInput, match="channel F of volts is in V"):
        estimate(Study(spring(), volts))


def test_record_names_differ_even_where_the_recordings_do_not() -> None:
    names = ["run", "run", "run#1", "other"]
    made = study(*(record(60, name=n) for n in names))
    assert len(set(made.record_names)) == 4
    assert made.record_names[3] == "other"
    assert study(record(60)).record_names == ("run",)


def test_odd_names_survive() -> None:
    name = 'a<b>&"%s {x} ü/..'
    found = estimate(study(record(200, name=name), record(200, seed=2, name=name)))
    assert name in str(found)
    assert "<b>" not in found._repr_html_()
    assert f"offset x @{name}#2" in {e.name for e in found.nuisances}


def test_changed_fixing_and_starting_keep_the_rest() -> None:
    made = study(
        record(60), free=("m", Vary("k", lower=100.0, upper=300.0, prior=LogNormal(200.0, 2.0))),
        noise="coloured", nuisances=Nuisances(lags=False), init=4,
    )  # fmt: skip
    held = made.fixing({"m": 0.6})
    assert held.free_names == ("k",)
    assert held.fixed == {"m": 0.6}
    assert held.noise == "coloured"
    begun = made.starting({"k": 1e6, "m": 0.4})
    assert begun.starts["k"] == 300.0
    assert begun.starts["m"] == 0.4
    assert begun.free[1].prior == LogNormal(200.0, 2.0)
    assert made.changed(hold="hold").hold == "hold"
    assert made.changed(hold="hold").nuisances == made.nuisances


def test_bounds_of_the_study_take_the_place_of_the_declared() -> None:
    found = estimate(study(free=("m", "d", Vary("k", start=240.0, lower=230.0, upper=500.0))))
    e = found.estimate_of("k")
    assert e.value == pytest.approx(230.0)
    assert e.at_bound
    inside = estimate(study(free=("m", "d", Vary("k", start=100.0, lower=100.0, upper=500.0))))
    assert inside.values["k"] == pytest.approx(200.0, rel=5e-3)
    assert not inside.estimate_of("k").at_bound


def test_study_travels_with_all_it_was_given() -> None:
    made = study(
        record(60), free=("m", Vary("k", own=True)), fixed={"d": 2.5}, initial={"q_k": 0.0},
        hold="hold", noise={"x": 1e-4}, nuisances=Nuisances(clock=1e-4),
        validation=record(80, name="v"), init=3, n_sub=2,
        process_noise={"m": 0.1},
    )  # fmt: skip
    other = pickle.loads(pickle.dumps(made))
    for name in ("free", "fixed", "initial", "hold", "noise", "nuisances", "splits", "init"):
        assert getattr(other, name) == getattr(made, name), name
    assert other.process_noise == made.changed(init=4).process_noise == {"m": 0.1}
    assert other.n_sub == 2
    assert other.record_names == made.record_names
    assert np.array_equal(other.validation[0]["x"], made.validation[0]["x"])
