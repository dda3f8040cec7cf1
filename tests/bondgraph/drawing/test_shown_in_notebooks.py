"""Graphs and equations as matplotlib axes and as tables."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from actuators.models.textbook import resonator
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.drawing.svg import svg
from bondgraph.equations.derivation import equations
from bondgraph.support.errors import UnusableInput


def mass(gain: float = 1.0) -> BondGraph:
    with BondGraph("mass") as g:
        Se("F", unit="N") >> One("j") >> I("m", 0.5, unit="kg")
        g["j"] >> R("d", 5.0, unit="N*s/m")
        g["j"] >> C("k", stiffness=2000.0, unit="N/m")
        g["j"] >> Dq("x", unit="m", gain=gain)
    return g


def test_a_graph_is_plotted_with_every_label_and_line_of_its_drawing() -> None:
    graph = resonator()
    (ax,) = graph.plot()
    page = ElementTree.fromstring(svg(graph))
    named = [e.text for e in page.iter() if e.tag.endswith("text")]
    lines = [e for e in page.iter() if e.tag.endswith("polyline")]
    assert [t.get_text() for t in ax.texts] == named
    assert len(ax.lines) == len(lines)
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # an SVG counts downwards
    ax.figure.canvas.draw()


def test_the_table_of_a_graph_has_a_row_for_each_element() -> None:
    table = mass(gain=1.1).to_pandas()
    assert list(table.index) == ["F", "j", "m", "d", "k", "x"]
    assert table.loc["k", "value"] == 2000.0
    assert table.loc["k", "unit"] == "N/m"
    assert table.loc["j", "joined to"] == "F, d, k, m, x"
    assert table.loc["d", "joined to"] == "j"


def test_equations_are_plotted_as_frequency_responses() -> None:
    size, phase = equations(mass()).plot()[:, 0]
    f, drawn = size.lines[0].get_data()
    s = 2j * np.pi * f
    exact = 1.0 / (0.5 * s**2 + 5.0 * s + 2000.0)
    assert drawn == pytest.approx(np.abs(exact), rel=1e-9)
    assert phase.lines[0].get_ydata() == pytest.approx(np.degrees(np.unwrap(np.angle(exact))))
    assert f[0] < 10.07 < f[-1]  # its mode, Hz
    assert size.get_title() == "x to F, m/N"


def pulled(load: bool = True, read: bool = True) -> BondGraph:
    """A mass on a spring between its load and a base whose velocity is given."""
    with BondGraph("pulled") as g:
        body, between, base = One("body"), Zero("between"), One("base")
        if load:
            Se("F", unit="N") >> body
            Sf("v_0", unit="m/s") >> base
        body >> I("m", 0.5, unit="kg")
        body >> R("d", 5.0, unit="N*s/m")
        body >> between >> C("k", stiffness=2000.0, unit="N/m")
        between >> base
        if read:
            body >> Df("v", unit="m/s")
            base >> Df("w", unit="m/s")
    return g


def test_an_input_that_does_not_reach_a_reading_has_no_phase() -> None:
    axes = equations(pulled()).plot()
    assert axes.shape == (4, 2)
    size, phase = axes[2:, 0]
    assert [t.get_text() for t in size.texts] == ["F does not reach w"]
    for ax in (size, phase):
        assert not np.isfinite(ax.lines[0].get_ydata()).any()
    assert not axes[2, 1].texts
    assert axes[0, 1].get_title() == "v to v_0, m/s/(m/s)"


@pytest.mark.parametrize(
    ("graph", "lacks"),
    [(pulled(load=False), "no source (Se, Sf)"), (pulled(read=False), "no sensor (De, Df, Dq)")],
)
def test_responses_of_nothing_are_refused(graph: BondGraph, lacks: str) -> None:
    with pytest.raises(UnusableInput, match=re.escape(f"pulled has {lacks}")):
        equations(graph).plot()


def test_the_table_of_equations_says_what_each_signal_is() -> None:
    table = equations(mass()).to_pandas()
    assert table.loc["e_d", "expression"] == "d*f_j"
    assert table.loc["dp_m/dt", "reason"] == "state of m"
    assert table.loc["x", "reason"] == "reading, m"
