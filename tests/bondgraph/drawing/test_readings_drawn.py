"""Readings in a drawing: dashed arrows from what they read, and what their channel does."""

from __future__ import annotations

from bondgraph.drawing.labels import describe
from bondgraph.drawing.readings import readings
from bondgraph.drawing.svg import svg
from tests.bondgraph.readings_bench import bench, power, shaken


def test_a_reading_points_from_what_it_reads() -> None:
    assert {(r.source, r.target) for r in readings(bench())} == {("k", "f"), ("F", "monitor")}
    assert {(r.source, r.target) for r in readings(power())} == {("F", "P"), ("v", "P")}
    assert {(r.source, r.target) for r in readings(shaken("rate"))} == {("s", "force")}


def test_every_reading_is_drawn_with_its_channel() -> None:
    text = svg(bench())
    for label in ("Dq : x", "Da : a", "Reading : f", "Reading : monitor"):
        assert f">{label}<" in text
    assert "Dq x m, gain 2.0, offset 0.01, resolution 0.002" in text
    assert describe(bench()["a"]) == (
        "Da a V, natural frequency 300.0, damping ratio 0.6, gain 0.1, offset -0.5"
    )
    assert describe(bench()["f"]) == "Reading f = e_k N, lag 0.004"
