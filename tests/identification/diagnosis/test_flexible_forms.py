"""Kinds of physics as columns: which at which element, finite, as long as the record."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.graph.elements import GY, TF, C, Element, I, R, Se, Sf, TwoPort
from bondgraph.graph.sensors import De, Df, Dq
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.effect import Signature, kind_at
from identification.diagnosis.screening.flexible_forms import (
    HATS,
    KINDS,
    SLOW,
    TIMES,
    curve,
    drifts,
    flexible_forms,
    plays,
    slow,
)
from identification.diagnosis.screening.port_history import PortHistory

N, DT = 700, 0.01
T = DT * np.arange(N)
MOVED = np.sin(3 * T) + 0.3 * np.sin(11 * T)


def past(argument: np.ndarray = MOVED) -> PortHistory:
    return PortHistory(argument, 30 * argument + 0.1, DT, np.cumsum(argument) * DT)


def sides(signature: Signature) -> np.ndarray:
    """Return the columns, those of the other side of a two-port beside them."""
    parts = [signature.columns] + ([] if signature.flow is None else [signature.flow])
    return np.hstack(parts)


def in_units_of(signature: Signature) -> list[np.ndarray]:
    """Return both sides; the whole of each may have a unit if it stands at a two-port."""
    if signature.flow is None:
        return [signature.columns]
    return [side / np.abs(side).max() for side in (signature.columns, signature.flow)]


EXPECTED = [
    (C("k", stiffness=1.0), {"restoring", "memory", "surface", "slow", "time"}),
    (R("d", 1.0), {"dissipative", "memory", "surface", "slow", "time"}),
    (TF("n", 2.0), {"ratio"}), (GY("g", 2.0), {"ratio"}),
    (Se("F"), {"command"}), (Sf("Q"), {"command"}), (Sf("w", measured=True), {"sensing"}),
    (Dq("x"), {"sensing"}), (De("p"), {"sensing"}), (Df("v"), {"sensing"}),
    (I("m", 1.0), set()),
]  # fmt: skip


@pytest.mark.parametrize(("element", "kinds"), EXPECTED, ids=lambda v: getattr(v, "name", ""))
def test_kinds_of_every_element(element: Element, kinds: set[str]) -> None:
    forms = flexible_forms(element, past())
    assert set(forms) == kinds
    assert kinds <= set(KINDS)
    for form in map(sides, forms.values()):
        assert form.shape[0] == N
        assert form.shape[1] >= 2
        assert np.isfinite(form).all()
        assert np.abs(form).max() < 1e3
        assert (np.ptp(form, axis=0) > 0).any()
    assert all((f.flow is not None) == isinstance(element, TwoPort) for f in forms.values())


@pytest.mark.parametrize("element", [e for e, kinds in EXPECTED if kinds], ids=lambda e: e.name)
@pytest.mark.parametrize("argument", [np.zeros(N), np.full(N, 4.0), np.eye(N)[5]])
def test_ports_that_hardly_move_give_finite_columns(element: Element, argument: np.ndarray) -> None:
    history = PortHistory(argument, 0.0 * argument, DT, np.cumsum(argument) * DT)
    for form in map(sides, flexible_forms(element, history).values()):
        assert form.shape[0] == N
        assert np.isfinite(form).all()


@pytest.mark.parametrize("element", [e for e, kinds in EXPECTED if kinds], ids=lambda e: e.name)
def test_columns_do_not_depend_on_units(element: Element) -> None:
    small = PortHistory(1e-6 * MOVED, 3e4 * MOVED, DT, 1e-6 * np.cumsum(MOVED) * DT)
    large = PortHistory(1e3 * MOVED, 3e-2 * MOVED, DT, 1e3 * np.cumsum(MOVED) * DT)
    for kind, signature in flexible_forms(element, small).items():
        other = flexible_forms(element, large)[kind]
        for form, same in zip(in_units_of(signature), in_units_of(other), strict=True):
            assert np.allclose(form, same, atol=1e-6 * np.abs(form).max())


def explained(columns: np.ndarray, wanted: np.ndarray) -> float:
    left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
    return float(1 - np.mean(left**2) / np.mean((wanted - wanted.mean()) ** 2))


def test_a_kind_spans_the_laws_of_its_kind_and_not_those_of_others() -> None:
    forms = {
        kind: form.columns for kind, form in flexible_forms(C("k", stiffness=1.0), past()).items()
    }
    cubic = MOVED**3
    play = MOVED - np.clip(MOVED, -0.2, 0.2)
    loop = plays(MOVED / np.abs(MOVED).max())[:, 2]
    assert explained(forms["restoring"], cubic) > 0.999
    assert explained(forms["restoring"], play) > 0.99
    assert explained(forms["memory"], loop) > 0.999
    assert explained(forms["restoring"], loop) < 0.95
    speed = flexible_forms(R("d", 1.0), past())["dissipative"].columns
    assert explained(speed, MOVED * np.abs(MOVED)) > 0.999
    assert explained(speed, np.tanh(MOVED / 0.03)) > 0.98


@pytest.mark.parametrize("power", [0.5, 1.0, 1.5, 2.0])
def test_what_leaks_from_a_store_is_slow(power: float) -> None:
    """Through an orifice, a porous seal, a weir, against turbulence."""
    z = 0.3 + MOVED - MOVED.min()
    gone = DT * np.cumsum(z**power)
    forms = flexible_forms(C("T", 1.0, unit="m3/Pa"), past(z))

    def left(*parts: np.ndarray) -> float:
        columns = np.hstack([*parts, np.ones((N, 1)), z[:, None]])
        return float(np.std(gone - columns @ np.linalg.lstsq(columns, gone, rcond=None)[0]))

    assert left(forms["slow"].columns) < 1e-3 * gone.std()
    assert left(forms["surface"].columns) > 0.5 * left()
    spring = flexible_forms(C("k", stiffness=1.0, unit="N/m"), past(z))
    assert left(spring["slow"].columns) > 1e-3 * gone.std()  # nothing leaves it


@pytest.mark.parametrize("element", [TF("n", 2.0), GY("g", 2.0)], ids=lambda e: e.name)
def test_a_ratio_that_changes_keeps_the_power(element: TF | GY) -> None:
    """The power that the effort gains is the power that the other side gives."""
    history = past()
    form = flexible_forms(element, history)["ratio"]
    assert form.flow is not None
    added_power = form.columns * history.output[:, None]
    assert added_power == pytest.approx(form.flow * history.argument[:, None])


def test_shapes() -> None:
    assert curve(MOVED).shape == (N, HATS)
    assert curve(MOVED).sum(axis=1) == pytest.approx(1.0)
    assert curve(np.zeros(N)).shape == (N, 1)
    assert drifts(N).shape[0] == N
    assert drifts(N).shape[1] >= TIMES
    assert slow(MOVED, DT).shape == (N, 2 * len(SLOW))
    assert np.abs(plays(MOVED)).max(axis=0) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_all_at_a_sensor_is_sensing_and_all_at_a_source_is_command(kind: str) -> None:
    assert kind_at(kind, Dq("x")) == "sensing"
    # a clock that all readings share is told at the source, and is no command
    assert kind_at(kind, Se("F")) == ("sensing" if kind == "sensing" else "command")
    assert kind_at(kind, Se("F", measured=True)) == "sensing"
    assert kind_at(kind, C("k", stiffness=1.0)) == kind
    assert kind_at(kind, R("d", 1.0)) == kind


def test_every_effect_of_the_catalogue_says_its_kind() -> None:
    assert [e.name for e in CATALOGUE if e.kind not in KINDS] == []
