"""Figures hold what they say: the floor at its place, peaks that survive thinning, valid SVG."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.validation import Judgement, Number, compare, judge
from identification.validation.figures import (
    Picture,
    comparison_figure,
    correlation_figure,
    distortion_figure,
    parameter_figure,
    residual_figure,
    trace_figure,
    waterfall_figure,
)
from identification.validation.figures.residuals import density
from identification.validation.figures.traces import worst_piece

from .made import coloured, material, record

N = 20000
Drawn = Callable[[Callable[[Judgement], Picture]], Picture]


@pytest.fixture(scope="module")
def judged() -> Judgement:
    rng = np.random.default_rng(1)
    e = rng.standard_normal(N)
    e[17000] = 60.0
    numbers = (
        Number("k$1", 2.0, "N/m", (1.9, 2.1), nominal=1.0),
        Number("<d>", 0.0, "N*s/m", (-np.inf, np.inf), at_bound=True, nominal=3.0),
        Number("zero", 0.0, "m", (-1.0, 1.0), nominal=0.0),
    )
    r = record(e, inputs={"F": coloured(rng, N, 0.5)})
    m = material(r, numbers=numbers)
    return judge(replace(m, starts=(1.0, 1.0, 30.0, np.inf)))


@pytest.fixture(scope="module")
def drawn(judged: Judgement) -> Drawn:
    """Draw each figure of `judged` once."""
    return cache(lambda draw: draw(judged))


FIGURES = (trace_figure, residual_figure, correlation_figure, parameter_figure, waterfall_figure)


@pytest.mark.parametrize("draw", FIGURES)
def test_each_figure_is_one_plain_svg(
    judged: Judgement, drawn: Drawn, draw: Callable[[Judgement], Picture]
) -> None:
    picture = drawn(draw)
    root = ElementTree.fromstring(picture.svg)
    assert root.tag.endswith("svg")
    assert "<script" not in picture.svg
    assert "href" not in re.sub(r'href="#[^"]*"', "", picture.svg)
    assert picture.caption
    assert len(picture.svg) < 400_000
    assert draw(judged).svg == picture.svg


def test_the_floor_is_in_every_figure_where_it_has_a_meaning(
    judged: Judgement, drawn: Drawn
) -> None:
    for draw in (trace_figure, residual_figure, waterfall_figure):
        assert "noise floor" in drawn(draw).svg
    assert "white noise at the floor" in drawn(residual_figure).svg
    assert "noise floor" in comparison_figure(compare({"a": judged, "b": judged})).svg


def test_axes_carry_units(drawn: Drawn) -> None:
    assert "x (m)" in drawn(trace_figure).svg
    assert "time (s)" in drawn(trace_figure).svg
    assert "frequency (Hz)" in drawn(residual_figure).svg
    assert "√Hz" in drawn(residual_figure).svg
    assert "lag (samples)" in drawn(correlation_figure).svg


def test_a_spike_survives_thinning_and_is_shown_near(judged: Judgement) -> None:
    piece = worst_piece(judged.material.records[0], 0)
    assert piece.start <= 17000 < piece.stop
    assert piece.stop - piece.start < 3000


def test_density_of_white_noise_is_that_of_the_floor() -> None:
    e = 2.0 * np.random.default_rng(2).standard_normal(N)
    f, a = density(e, np.ones(N, bool), 0.01)
    # one-sided: sigma^2 spread over the Nyquist frequency of 50 Hz
    assert np.sqrt(np.mean(a**2)) == pytest.approx(2.0 / np.sqrt(50), rel=0.05)
    assert f[-1] == pytest.approx(50, rel=0.02)


def test_the_waterfall_counts_the_starts(judged: Judgement, drawn: Drawn) -> None:
    assert drawn(waterfall_figure).caption == (
        "2 of 4 starts end in the best valley; 1 could not be simulated."
    )
    single = replace(judged, material=replace(judged.material, starts=(1.0,)))
    assert waterfall_figure(single).svg == ""


def test_of_many_readings_the_worst_are_drawn() -> None:
    rng = np.random.default_rng(3)
    records = [record((k + 1) * rng.standard_normal(300), name=f"r{k}") for k in range(9)]
    picture = trace_figure(judge(material(*records)))
    assert "x of r8" in picture.svg
    assert "x of r2" not in picture.svg
    assert "The 3 readings nearest to the floor are left out" in picture.caption


def test_distortion_is_drawn_by_kind_of_line() -> None:
    n = 400
    t = np.arange(6 * n)
    u = np.sum([np.cos(2 * np.pi * k * t / n + k) for k in (1, 3, 7, 9, 13)], axis=0)
    noise = 1e-3 * np.random.default_rng(5).standard_normal(t.size)
    j = judge(material(record(0.01 * u**2 + noise, simulated=u, inputs={"F": u}, floor=1e-3)))
    svg = distortion_figure(j.separated[0]).svg
    for word in ("excited", "odd, left out", "even, left out", "residual at excited", "noise"):
        assert word in svg


def test_a_picture_is_saved_as_svg_only(drawn: Drawn, tmp_path: Path) -> None:
    picture = drawn(parameter_figure)
    file = picture.save(tmp_path / "p.svg")
    assert file.read_text(encoding="utf-8") == picture.svg
    assert picture._repr_svg_() == picture.svg
    with pytest.raises(UnusableInput, match=r"saved as \.svg"):
        Picture("<svg/>").save(tmp_path / "p.png")
