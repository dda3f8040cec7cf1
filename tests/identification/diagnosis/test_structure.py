"""Ports that the sensors cannot tell apart, and the signal that would."""

from __future__ import annotations

import numpy as np

from actuators import stack_bond_graph
from bondgraph import Df
from identification.diagnosis.localisation.structural_classes import (
    excited_frequencies,
    latent_columns,
    splitting_signals,
    structure,
)
from tests.spring import spring

W = np.geomspace(1.0, 1e4, 20)


def test_one_reading_alone_tells_no_port_apart() -> None:
    s = structure(spring(), W)
    assert set(s.class_of("k")) == {"d", "k", "m", "F", "x"}
    assert s.class_of("nothing") == ("nothing",)


def test_two_readings_tell_sensors_from_ports() -> None:
    s = structure(spring().with_branch("v", [Df("u", unit="m/s")]), W)
    assert set(s.class_of("k")) == {"d", "k", "m", "F"}
    assert s.class_of("x") == ("x",)
    assert s.class_of("u") == ("u",)
    assert sorted(n for c in s.classes for n in c) == ["F", "d", "k", "m", "u", "x"]


def test_latent_effort_acts_like_the_transfer_function() -> None:
    names, columns = latent_columns(spring(), W)
    exact = 1 / (200.0 + 2j * W - 0.5 * W**2)
    assert np.allclose(columns[:, 0, names.index("F")], exact)
    assert np.allclose(np.abs(columns[:, 0, names.index("k")]), np.abs(exact))
    assert np.allclose(columns[:, 0, names.index("x")], 1)


def test_current_splits_the_polarisation_from_the_drive() -> None:
    low = np.geomspace(1.0, 1e3, 12)
    alone = stack_bond_graph(sensors=("x",))
    both = stack_bond_graph(sensors=("x", "i"))
    assert {"C_nl", "R_e", "V_in"} <= set(structure(alone, low).class_of("C_nl"))
    together = set(structure(both, low).class_of("C_nl"))
    assert len(together) < len(structure(alone, low).class_of("C_nl")) or "k" not in together
    rivals = [n for n in structure(alone, low).class_of("C_nl") if n != "C_nl"]
    for signal, junction, split in splitting_signals(alone, "C_nl", rivals, low):
        assert signal in (f"f_{junction}", f"e_{junction}")
        assert set(split) <= set(rivals)
        assert split


def test_excited_frequencies() -> None:
    t = 1e-3 * np.arange(4000)
    u = np.sin(2 * np.pi * 10 * t) + np.sin(2 * np.pi * 40 * t)
    w = excited_frequencies([u], 1e-3, 6)
    assert (np.diff(w) > 0).all()
    near = np.minimum(np.abs(w - 20 * np.pi), np.abs(w - 80 * np.pi))
    assert (near < 2 * np.pi * 6).all()
    for nothing in ([], [np.zeros(100)], [np.ones(2)]):
        flat = excited_frequencies(nothing, 1e-3)
        assert np.isfinite(flat).all()
        assert flat.max() <= np.pi / 1e-3 * 1.001
