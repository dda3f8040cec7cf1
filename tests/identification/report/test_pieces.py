"""Pieces of a page: what is text stays text, what was made here stays as it is."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest

from identification.report import html
from identification.report.canvas import drawing
from identification.report.numbers import ends, interval, quantity
from identification.report.words import ended, listed, spaced, stopped

EVIL = "<b onclick=alert(1)>\"&'"


def test_text_is_escaped_wherever_it_stands() -> None:
    pieces = [
        html.heading(EVIL), html.paragraph(EVIL), html.figure("<svg ></svg>", EVIL),
        html.folded(EVIL, html.heading(EVIL)), html.bullets([EVIL]), html.numbered([EVIL]),
        html.facts([(EVIL, EVIL)]), html.table((EVIL,), [(EVIL,)], (), (EVIL,)),
        html.remarks([(EVIL, EVIL, EVIL)]), html.code(EVIL),
        html.equations([("after", EVIL, EVIL)]),
        html.head(EVIL, (EVIL, "#fff"), EVIL, [(EVIL, EVIL)]),
    ]  # fmt: skip
    text = html.page("fit", EVIL, [html.section(EVIL, *pieces)], source=EVIL, same=EVIL)
    assert "<b onclick" not in text
    assert 'class="<' not in text
    assert text.count("&lt;b onclick") >= 20
    assert "&amp;lt;" not in text


def test_a_plain_text_among_the_parts_is_no_html() -> None:
    assert "&lt;p&gt;" in html.section("a", "<p>not made here</p>")
    assert "<p>made here</p>" in html.section("a", html.trusted("<p>made here</p>"))


@pytest.mark.parametrize("empty", [
    html.section("a", "", ""), html.paragraph(""), html.figure(""),
    html.folded("a", ""), html.box(""), html.bullets([]), html.table(("a",), []),
    html.equations([]), html.remarks([]),
])  # fmt: skip
def test_what_holds_nothing_is_nothing(empty: str) -> None:
    assert empty == ""


def test_the_style_sheet_is_whole_in_the_page() -> None:
    css = files("identification.report").joinpath("templates/report.css").read_text("utf-8")
    text = html.page("fit", "a", [], source="fit", same="fit")
    assert css.strip() in text
    assert css.count("{") == css.count("}")


def test_a_table_has_a_class_for_each_row() -> None:
    text = html.table(("a", "b"), [("x", "1"), ("y", html.bar(0.5, "winner"))], (1,), ("named",))
    assert text.count('<tr class="named">') == 1
    assert text.count('<td class="n"') == 2
    assert 'style="width:50.0%"' in text


def test_a_drawing_is_the_same_twice_and_white_on_paper(tmp_path: Path) -> None:
    def drawn() -> str:
        with drawing("d", 1.0, 1.0) as canvas:
            canvas.ax.plot([0, 1], [0, 1])
        return canvas.svg

    assert drawn() == drawn()
    assert 'id="d-' in drawn()
    with drawing("d", 1.0, 1.0, paper=True) as canvas:
        canvas.ax.plot([0, 1], [0, 1])
    assert canvas.figure.get_facecolor() == (1.0, 1.0, 1.0, 1.0)


def test_small_words() -> None:
    assert listed([]) == ""
    assert listed("a") == "a"
    assert listed("abc") == "a, b and c"
    assert spaced("dry_friction") == "dry friction"
    assert ended("why?") == "why?"
    assert stopped("it moves") == "It moves."
    assert stopped("") == ""


@pytest.mark.parametrize("told", [interval, ends])
def test_a_value_and_both_ends_of_its_interval_are_in_one_unit(told: Callable[..., str]) -> None:
    assert quantity(0.95e-3, "N") == "950 µN"
    assert told(0.9e-3, 1.2e-3, "N", 0.95e-3) == "900 … 1200 µN"
    assert told(0.9e-3, 1.2e-3, "N", 1.05e-3).endswith((" … 1.2 mN", " … 1.20 mN"))
    # what is not known at all is told by its ends
    assert told(-2.5, 2.5, "m", 1e-9) == "−2.5 … 2.5 m"
