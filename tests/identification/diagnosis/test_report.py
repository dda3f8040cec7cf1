"""The report: every kind of verdict gives one self-contained page."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import asdict, replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from bondgraph import MTF, BondGraph, C, Dq, I, One, R, Se
from bondgraph.drawing.shading import fill
from bondgraph.graph.modulation import displacement
from bondgraph.laws import (
    Coulomb,
    FrictionAlongWay,
    FrictionUnderLoad,
    Law,
    LettingGo,
    QuadraticDrag,
)
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.explanation.rivals import standings, title
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.regions import summary
from identification.diagnosis.report import sections
from identification.diagnosis.report.changed import changes, definition, math_svg, whole_law
from identification.diagnosis.report.evidence import parameters
from identification.diagnosis.report.found import confidence_of, regions_of
from identification.diagnosis.report.law import law_ports, path
from identification.diagnosis.report.law_figures import law_figure
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.studio import page, write_report
from identification.diagnosis.verdict.document import verdict
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.diagnosis.verdict.text import in_words
from identification.report.numbers import (
    axis_scale,
    interval,
    percent,
    prefixed,
    quantity,
    short,
    telling_apart,
)
from tests.identification.diagnosis import rubbing_spring
from tests.patience import HANGS
from tests.settled import simulate
from tests.spring import spring

N = 400
HOSTILE = '<script>alert("x")</script> & $\\frac{'
SECTIONS = (
    "Before and after", "Where in the model", "The law that was found",
    "The equation that changed", "The rivals", "What was checked",
    "Where in the recording the model fails", "Parameters", "What this does not say",
)  # fmt: skip


def recording(n: int = N) -> Recording:
    t = np.asarray(np.arange(n) * 0.01, np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    truth = spring().with_element("d", law=Coulomb(0.8))
    x = simulate(truth, t, {"F": u})["x"]
    x = x + 2e-5 * np.random.default_rng(1).standard_normal(n)
    return Recording(HOSTILE, t, {"F": u, "x": x}, {"F": "N", "x": "m"})


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    """A diagnosis with a few effects only, cut short: only its shape matters here."""
    few = ("coulomb_friction", "delay", "quadratic_drag")
    without = tuple(e.name for e in CATALOGUE if e.name not in few)
    cheap = DiagnosisOptions(jobs=1, keep=3, more=0, effects=1, without=without)
    split = Split(slice(0, 300), slice(300, N), "first three quarters train")
    return diagnose(spring(), recording(), split, model=HOSTILE, options=cheap)


@pytest.fixture(scope="module")
def few() -> Diagnosis:
    return diagnose(spring(), recording(25), model=HOSTILE, options=DiagnosisOptions(jobs=1))


def as_kind(d: Diagnosis, kind: str) -> Diagnosis:
    """The same diagnosis with another verdict."""
    assert d.decision is not None
    best = d.decision.chosen or d.trials[0]
    if kind in ("missing_physics", "unknown_physics"):
        return replace(d, kind=kind, steps=(replace(d.decision, kind=kind, chosen=best),))
    return replace(d, kind=kind, steps=(replace(d.decision, kind="explained", chosen=None),))


class Well(HTMLParser):
    """Checks that tags close in order and collects ids."""

    VOID = frozenset({"meta", "br", "link", "img", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.ids += [str(v) for k, v in attrs if k == "id"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def check(text: str) -> None:
    outside = re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)
    assert not re.search(r"https?://|//\w+\.\w+/|@import|src=", outside)
    assert not re.search(r"<\?xml|<!DOCTYPE svg|<metadata", text)
    assert HOSTILE not in text
    assert len(text.encode()) < 1_500_000
    parser = Well()
    parser.feed(text)
    assert parser.open == []
    assert not parser.tags & {"link", "iframe", "img"}
    assert len(re.findall("<script", text)) == 2  # its data and its own, known by its hash
    assert len(parser.ids) == len(set(parser.ids))
    drawings = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    for ref in re.findall(r'(?:href="#|url\(#)([^")]+)', drawings):
        assert ref in parser.ids
    for drawn in re.findall(r"<svg.*?</svg>", text, flags=re.DOTALL):
        ET.fromstring(drawn)


@pytest.fixture(scope="module")
def missing(found: Diagnosis) -> str:
    """The page of a named effect."""
    return page(as_kind(found, "missing_physics"))


def test_missing_and_unknown_give_a_self_contained_page(found: Diagnosis, missing: str) -> None:
    check(missing)
    check(page(as_kind(found, "unknown_physics")))


def test_missing_physics_has_every_section(missing: str) -> None:
    text = missing
    heads = re.findall(r"<h2[^>]*>(.*?)</h2>", text)
    for s in SECTIONS:
        assert any(h.startswith(s) for h in heads), s
    assert "&lt;script&gt;" in text
    assert "@media print" in text


def test_insufficient_data_shows_the_recording_and_the_reason(few: Diagnosis) -> None:
    assert few.kind == "insufficient_data"
    text = page(few)
    check(text)
    assert "What was recorded" in text
    assert "too few" in text


def test_unknown_physics_without_any_trial(found: Diagnosis) -> None:
    check(page(replace(found, kind="unknown_physics", trials=(), steps=(), structure=None)))


def test_what_was_fitted_to_held_out_samples_is_said(found: Diagnosis) -> None:
    plain = sections.before_after(found)
    assert "Held-out samples are shaded above. They took no part in any fit." in plain
    assert "held-out one is fitted" not in " ".join(found.notes)
    assert found.data is not None
    several = replace(found, data=replace(found.data, breaks=(found.data.n // 2,)))
    text = sections.before_after(several)
    assert "the initial state of each held-out recording, which is fitted to them" in text


def test_own_limits_reach_the_verdict_and_the_reading_of_it(found: Diagnosis) -> None:
    """What is left counts as noise by the caller's limits, which the verdict repeats."""
    d = as_kind(found, "unknown_physics")
    assert d.left is not None
    left = replace(d.left, over_noise={"x": 2.0})
    last = replace(d.steps[-1], kind="unknown_physics", physics="memory", places=("k",))
    half = replace(d, left=left, steps=(*d.steps[:-1], last))
    assert "limits" not in verdict(half)
    assert verdict(half)["remaining"]["x"]["kind"] == "memory"
    own = verdict(replace(half, limits=Thresholds(noise=2.5)))
    assert own["remaining"]["x"]["kind"] == ""
    assert own["limits"] == asdict(Thresholds(noise=2.5))
    retold(parse_verdict(json.dumps(own)))


def test_a_diagnosis_carries_its_limits() -> None:
    own = Thresholds(law=0.5)
    assert diagnose(spring(), recording(25), limits=own).limits == own
    assert diagnose(spring(), recording(25)).limits == Thresholds()


def test_terminal_page_and_file_give_the_same_intervals_and_stretches(found: Diagnosis) -> None:
    d = as_kind(found, "missing_physics")
    lines, page = in_words(d).splitlines(), parameters(d)
    (said,) = verdict(d)["findings"]
    assert said["parameters"]
    for p in said["parameters"]:
        low, high = p["ci95"]
        n = max(4, telling_apart(low, high))
        assert any(f"{p['name']} = " in s and f"[{low:.{n}g}, {high:.{n}g}]" in s for s in lines)
        assert interval(low, high, p["unit"]) in page
    seen = [s.removeprefix("seen: ") for s in lines if s.startswith("seen: ")]
    assert seen
    assert seen == list(summary(regions_of(d)))[:3]


def test_the_terminal_gives_fitted_values_beside_the_declared_ones(
    found: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    for kind in ("parameters_only", "missing_physics"):
        d = as_kind(found, kind)
        lines = in_words(d).splitlines()
        (head,) = (i for i, line in enumerate(lines) if line.startswith("fitted  "))
        assert re.split(r"  +", lines[head])[1:] == ["value", "95 % interval", "declared"]
        (row,) = (re.split(r"  +", line) for line in lines[head:] if line.startswith("k "))
        value = next(e["value"] for e in verdict(d)["parameters"] if e["name"] == "k")
        assert float(row[1].split()[0]) == pytest.approx(value, rel=0.02)
        assert " … " in row[2]
        assert row[3] == "200 N/m"
    monkeypatch.setattr("identification.diagnosis.verdict.lines.MOST_VALUES", 1)
    assert "2 more in verdict.json" in in_words(as_kind(found, "parameters_only"))
    unnamed = in_words(as_kind(found, "unknown_physics"))
    assert "values of the model as it is, which leaves" in unnamed


def test_without_a_name_each_recording_says_how_far_it_is_missed(found: Diagnosis) -> None:
    d = as_kind(found, "unknown_physics")
    assert "the model misses" not in in_words(d)
    assert d.nominal is not None
    data = d.nominal.problem.data
    readings = data.readings.copy()
    readings[: N // 4] += 100.0 * data.floor
    bent = replace(d.nominal.problem, data=replace(data, readings=readings))
    parts = [{"name": n, "sha256": "", "samples": s} for n, s in (("a", N // 4), ("b", N - N // 4))]
    run = replace(d.recording, meta={"parts": parts})
    nominal = replace(d.nominal, problem=bent)
    two = replace(d, recording=run, nominal=nominal)
    said = [s for s in in_words(two).splitlines() if s.startswith("recording ")]
    assert [s.split()[1] for s in said] == ["a:", "b:"]
    assert re.fullmatch(r"recording a: the model misses x by \d+ times its noise", said[0])


def test_places_carry_their_confidence(found: Diagnosis) -> None:
    d = as_kind(found, "missing_physics")
    weights = confidence_of(d)
    assert d.decision is not None
    assert d.decision.chosen is not None
    assert max(weights, key=weights.__getitem__) == d.decision.chosen.element
    assert all(0 <= w <= 1 for w in weights.values())
    assert sum(weights.values()) == pytest.approx(1.0)
    drawn = sections.graph(d)
    assert fill(weights[d.decision.chosen.element]) in drawn
    assert "plausibility of the place" in drawn
    assert "plausibility of the place" not in sections.graph(as_kind(found, "explained"))


def test_two_effects_with_relations_traits_and_experiments(found: Diagnosis) -> None:
    """Both effects are in the drawing, the laws and the steps, without ids that clash."""
    d = as_kind(found, "missing_physics")
    (first,) = d.steps
    assert first.chosen is not None
    other = next(t for t in d.trials if t.element != first.chosen.element)
    both = replace(d, steps=(first, replace(first, chosen=other)))
    told: dict[str, object] = {
        "relations": (
            BlindRelation(("k", "d"), 40.0, 1.01, 0.99, 0.3, 900.0, 40.0),
            BlindRelation(("m",), 40.0, 21.0, 19.0, 300.0, 900.0, 40.0),
            BlindRelation(("n",), np.nan, np.nan, np.nan, np.nan, 0.0, 40.0, 2),
        ),
        "experiments": (
            Experiment("record a slow sweep", "sweep", 6.2, 1.0, 100, 1.0, ("a", "b")),
        ),
        "traits": {
            "d": (
                SimpleNamespace(
                    variable="rate", words="it depends on the speed", explained={"sign": 0.9}
                ),
                SimpleNamespace(signal=np.ones(N), explained=0.8),
            ),
            "away": (SimpleNamespace(words="it gives energy", explained={"time": 0.1}), None),
        },
    }
    text = page(replace(both, **told))  # type: ignore[arg-type]
    check(text)
    assert "second step" in text
    assert "not here alone: whatever the law there, 4.58 times the noise is left" in text
    assert f"found here, {title(first.chosen).partition(' at ')[0]}" in text
    for t in (first.chosen, other):
        assert f"<h3>{title(t)}</h3>" in text
    for words in (
        "record a slow sweep: expected to tell a from b by 6.2 standard errors (1 now)",
        "It depends on the speed",
        "What d must have added",
        "It is rebuilt from what the model as it is leaves",
    ):
        assert words in text
    assert "at away" not in text, "a name was told elsewhere"
    none: dict[str, object] = {
        "traits": {"d": (SimpleNamespace(variable="nothing", words="none", explained={}), None)}
    }
    # the headline says that a law there does
    assert "with those refitted the law that was named does" in page(replace(both, **none))  # type: ignore[arg-type]


PROBE = """<script>addEventListener("load", () => {
 const cut = [...document.querySelectorAll(".scroll,section,table,.tiles,figure:not(.graph)")]
  .filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName);
 parent.postMessage(JSON.stringify({name: "NAME", cut,
  over: document.documentElement.scrollWidth - innerWidth,
  heads: [...document.querySelectorAll("h2")].map(e => e.innerText),
  loaded: performance.getEntriesByType("resource").length,
  ink: getComputedStyle(document.body).color,
  paper: getComputedStyle(document.body).backgroundColor,
  mute: [...document.querySelectorAll("figure svg")].filter(e => !e.querySelector("title") &&
   !e.getAttribute("aria-label") && !e.parentElement.querySelector("figcaption")).length,
  flat: [...document.querySelectorAll("svg")].filter(e => e.getBoundingClientRect().height < 4)
   .length}), "*")})</script>"""
WRAPPER = """<!DOCTYPE html><html><body>FRAMES<script>
addEventListener("message", e => { const p = document.createElement("pre");
 p.textContent = e.data; document.body.append(p) })</script></body></html>"""
WIDTHS = {"phone": 390, "desk": 1280, "paper": 688}
"""CSS pixels; the text of an A4 page with its margins is 688 wide."""


def browser() -> str:
    """Path of a Chromium; the test is skipped where there is none."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    pytest.skip("no Chromium here (Debian: apt-get install chromium): the page was not opened")


def test_opens_in_a_browser(missing: str, tmp_path: Path) -> None:
    """Phone, desk and paper: all sections, nothing cut off, no error, nothing loaded."""
    program, text = browser(), missing
    frames = []
    for name, width in WIDTHS.items():
        shown = text.replace("@media print{@page", "@media all{@page") if name == "paper" else text
        probe = PROBE.replace("NAME", name)
        (tmp_path / f"{name}.html").write_text(
            shown.replace("<head>", f"<head>{probe}", 1), encoding="utf-8"
        )
        frames.append(f'<iframe src="{name}.html" style="width:{width}px;height:900px"></iframe>')
    wrapper = tmp_path / "all.html"
    wrapper.write_text(WRAPPER.replace("FRAMES", "".join(frames)), encoding="utf-8")
    done = subprocess.run(
        [
            program, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
            f"--user-data-dir={tmp_path / 'profile'}", "--enable-logging=stderr",
            "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=5000", "--dump-dom",
            wrapper.as_uri(),
        ],
        capture_output=True, text=True, timeout=HANGS, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-500:]
    assert "CONSOLE" not in done.stderr
    told = [json.loads(html.unescape(t)) for t in re.findall(r"<pre>(.*?)</pre>", done.stdout)]
    assert {t["name"] for t in told} == set(WIDTHS)
    for t in told:
        for s in SECTIONS:
            assert any(h.startswith(s) for h in t["heads"]), (t["name"], s)
        assert t["over"] <= 0, t
        assert t["cut"] == [], t
        assert (t["loaded"], t["mute"], t["flat"]) == (0, 0, 0), t
        assert (t["ink"], t["paper"]) == ("rgb(31, 41, 51)", "rgb(255, 255, 255)")


def test_explained_twice_is_the_same_and_leaves_settings_alone(found: Diagnosis) -> None:
    d, before = as_kind(found, "explained"), dict(mpl.rcParams)
    text = page(d)
    check(text)
    assert page(d) == text
    assert dict(mpl.rcParams) == before


def test_written_atomically(
    few: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = write_report(few, tmp_path / "new")
    assert target == tmp_path / "new" / "report.html"
    old = target.read_text(encoding="utf-8")

    def broken(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", broken)
    with pytest.raises(UnusableInput, match="disk full"):
        write_report(replace(few, seed=7), tmp_path / "new")
    assert target.read_text(encoding="utf-8") == old
    assert [p.name for p in target.parent.iterdir()] == ["report.html"]


def test_every_fitted_effect_has_a_figure_and_a_settable_formula() -> None:
    """All that the whole catalogue's screening sends to a fit."""
    found = rubbing_spring.diagnosed()
    assert found.nominal is not None
    assert len({t.effect for t in found.trials}) >= 3
    for t in found.trials:
        svg, caption = law_figure(found, t)
        assert not svg or (svg.startswith("<svg") and caption), t.label
        assert svg or path(t) is not None or not law_ports(t.fit), t.label
        for tex in (definition(t)[0], whole_law(t)):
            assert not tex or math_svg(tex, "x").startswith("<svg"), (t.label, tex)
        steps, _ = changes(found.nominal.problem.graph, t.fit.problem.graph)
        for c in steps:
            for tex in filter(None, (c.before, c.after)):
                assert math_svg(tex, "x"), (t.label, tex)


def lever() -> BondGraph:
    """A graph that is not linear up to laws."""
    with BondGraph("lever") as g:
        body, inner = One("body"), One("inner")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m")
        body >> MTF("arm", ratio=20.0 * displacement("k")) >> inner
        inner >> C("c", stiffness=30.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def test_equations_that_are_not_linear_up_to_laws_are_shown_too() -> None:
    rubbing = lever().with_element("d", law=Coulomb(0.8))
    (step,), (rate,) = changes(lever(), rubbing)
    assert (step.before, step.why) == ("e_{d} = d f_{body}", "R d")
    assert step.after == r"e_{d} = \varphi_{d}{\left(f_{body} \right)}"
    assert rate.why == "rate of p_m"
    assert "q_{c} q_{k}" in rate.before
    assert r"\varphi_{d}{\left(\frac{p_{m}}{m} \right)}" in rate.after
    assert all(math_svg(t, "x") for t in (step.after, rate.before, rate.after))
    # an effect may make a graph so that was not
    assert changes(spring(), lever())[1]


def test_changed_equations_of_plain_graphs_are_as_derived() -> None:
    (step,), (rate,) = changes(spring(), spring().with_element("d", law=Coulomb(0.8)))
    assert (step.before, step.why) == ("e_{d} = d f_{v}", "R d")
    assert step.after == r"e_{d} = \varphi_{d}{\left(f_{v} \right)}"
    assert (rate.why, "\\varphi_{d}{\\left(" in rate.after) == ("rate of p_m", True)


def test_every_trial_is_listed_with_a_reason(found: Diagnosis) -> None:
    rows = standings(as_kind(found, "missing_physics"))
    assert len(rows) == len(found.trials)
    assert all(s.why for s in rows)
    assert [s.role for s in rows].count("winner") == 1
    scores = [s.trial.test for s in rows if np.isfinite(s.trial.test)]
    assert scores == sorted(scores)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.2e-6, "m", "3.2 µm"), (0.0125, "A", "12.5 mA"), (-12e3, "N/m", "−12 kN/m"),
        (5.0, "kg", "5 kg"), (1e-9, "kg", "1·10⁻⁹ kg"), (0.0, "m", "0 m"), (2.0, "1", "2"),
        (1e-6, "m^2", "1·10⁻⁶ m^2"), (float("nan"), "m", "– m"),
    ],
)  # fmt: skip
def test_quantities(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_numbers() -> None:
    assert prefixed("ohm", 2e3) == (1e-3, "kΩ")
    assert axis_scale("kg", 2e-6)[1] == "10⁻⁶ kg"
    assert short(float("inf")) == "∞"
    assert percent(0.00606) == "0.606 %"
    assert percent(float("nan")) == "–"


def test_where_it_fails_says_of_what_its_numbers_are(found: Diagnosis) -> None:
    said = str(as_kind(found, "missing_physics"))
    assert said.count("seen: of the model as it is, fitted, on all scored samples") == 1
    assert said.index("seen: from" if "seen: from" in said else "seen: ") < said.index("(seen: of")


def test_no_rival_explains_more_than_everything(found: Diagnosis) -> None:
    """Though the floor may have been read above what the repair leaves."""
    step = found.decision
    assert step is not None
    assert step.chosen is not None
    low = replace(step, chosen=replace(step.chosen, test=0.5))
    shares = [s.share for s in standings(replace(found, steps=(low,)), low)]
    assert max(shares) == pytest.approx(1.0)


def test_of_what_leaves_less_than_the_noise_no_factor_is_told(
    found: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "identification.diagnosis.explanation.rivals.strength_shown", lambda t: True
    )
    step = found.decision
    assert step is not None
    assert step.chosen is not None
    best = step.chosen.blocks
    worse = best + np.random.default_rng(0).uniform(1.0, 2.0, best.size)
    others = [t for t in step.trials or found.trials if t.effect != "unknown"]
    lost = tuple(replace(t, test=0.9, blocks=worse) for t in others)
    low = replace(step, chosen=replace(step.chosen, test=0.5), trials=lost)
    said = [s.why for s in standings(replace(found, steps=(low,)), low)]
    assert any("leaves more than" in w for w in said)
    assert not any("nan" in w for w in said)
    # what is told is the quotient of what the table shows
    chosen = replace(step.chosen, test=1.21)
    lost = tuple(replace(t, test=4 * 1.21, blocks=worse) for t in others)
    high = replace(step, chosen=chosen, trials=(*lost,))
    told = {s.why for s in standings(replace(found, steps=(high,)), high) if s.role == "lost"}
    assert told == {"leaves 2 times as much"}
    monkeypatch.setattr(
        "identification.diagnosis.explanation.rivals.strength_shown", lambda t: False
    )
    for factor, wanted in ((4 * 1.21, "not determined"), (0.99 * step.nominal, "does not differ")):
        lost = tuple(replace(t, test=factor, blocks=worse) for t in others)
        none = replace(high, trials=lost)
        told = {s.why for s in standings(replace(found, steps=(none,)), none) if s.role == "lost"}
        assert [wanted in w for w in told] == [True]
    old = verdict(as_kind(found, "missing_physics"))
    for t in old["steps"][0]["tried"]:
        t["why"] = "leaves nan times as much above the noise"
    assert "nan" not in retold(old)


def test_a_law_is_written_in_the_symbols_of_the_fit() -> None:
    """No name is made up: what stands in the formula stands in the list of parameters."""
    graph = spring()
    for name, effect, shown in (
        ("d", "coulomb_friction", r"w_{d}(v) = F_{c_{d}} \operatorname{sgn}{\left(v \right)}"),
        ("d", "quadratic_drag", r"w_{d}(v) = c_{2_{d}} v \left|{v}\right|"),
    ):
        law = {"coulomb_friction": Coulomb(0.3), "quadratic_drag": QuadraticDrag(0.2)}[effect]
        made: Any = SimpleNamespace(
            fit=SimpleNamespace(problem=SimpleNamespace(graph=graph.with_element(name, law=law))),
            element=name, effect=effect, insertion=SimpleNamespace(form=False, law=effect),
        )  # fmt: skip
        assert definition(made) == (shown, "v is the velocity of d")


@pytest.mark.parametrize(
    ("law", "holds"),
    [
        (FrictionUnderLoad("e_k"), r"\mu_{1_{d}} \left|{e_{k}}\right|"),
        (FrictionAlongWay("q_k"), r"q_{k}"),
        (LettingGo("q_k"), r"q_{k}"),
    ],
)
def test_a_law_that_watches_is_written_with_what_it_watches(law: Law, holds: str) -> None:
    graph = spring().with_element("d", law=law)
    made: Any = SimpleNamespace(
        fit=SimpleNamespace(problem=SimpleNamespace(graph=graph)),
        element="d", effect=law.name, insertion=SimpleNamespace(form=False, law=law.name),
    )  # fmt: skip
    formula, meaning = definition(made)
    assert formula.startswith(rf"w_{{d}}(v, {'e' if 'e_k' in repr(law) else 'q'}_{{k}}) = ")
    assert holds in formula.split(" = ")[1]
    assert meaning == f"v is the velocity of d, {law.watched} is read beside it"
    assert math_svg(formula, "law").startswith("<svg")
