"""Error against coverage: the tool and every baseline, each by its own knob of abstention."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hardware.simulators.judging.truths import ExamTruth
from identification.report.tables import markdown
from tests.proof.trial.forest import forest
from tests.proof.trial.rates import Rate, rate
from tests.proof.trial.rivals import RULES, Content, Pick, Rule, tool

TOOL = "the tool"
FOREST = "random forest"
PARTS = (1.0, 0.5)
"""Parts of the largest coverage that both reach, at which a baseline is held against the tool."""


@dataclass(frozen=True, slots=True)
class Counted:
    """What is told at one setting of a knob.

    Attributes
    ----------
    named : Rate
        Recordings that are given a name, of those with an effect that has one.
    wrong : Rate
        Wrong names, of these.
    misplaced : Rate
        Wrong places, of these.
    alarms : Rate
        Recordings that are given a name, of those without such an effect: the controls and physics
        outside the vocabulary.
    """

    named: Rate
    wrong: Rate
    misplaced: Rate
    alarms: Rate


@dataclass(frozen=True)
class Curve:
    """One rule at all settings of its knob.

    Attributes
    ----------
    counts : tuple of Counted
        From the most cautious setting to the one that withholds nothing.
    """

    name: str
    counts: tuple[Counted, ...]

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """Coverage and error of names."""
        return tuple((c.named.value, c.wrong.value) for c in self.counts if c.wrong.total)

    @property
    def alarms(self) -> tuple[tuple[float, float], ...]:
        """Coverage, and names given where there is none to give."""
        return tuple((c.named.value, c.alarms.value) for c in self.counts)

    def at(self, coverage: float) -> Counted:
        """Return the most cautious setting that covers as much."""
        enough = (c for c in self.counts if c.named.value >= coverage - 1e-12)
        return next(enough, self.counts[-1])


@dataclass(frozen=True, slots=True)
class EqualCoverage:
    """The tool and a baseline at the settings at which both name as many recordings."""

    name: str
    coverage: float
    tool: Counted
    baseline: Counted

    @property
    def ahead(self) -> bool:
        """The tool errs less in names, and names no more where there is none to give."""
        return (
            self.tool.wrong.value < self.baseline.wrong.value
            and self.tool.alarms.value <= self.baseline.alarms.value
        )

    @property
    def surely(self) -> bool:
        """The exact 95 % intervals of the errors in names do not meet."""
        return self.tool.wrong.exact[1] < self.baseline.wrong.exact[0]

    @property
    def words(self) -> str:
        """Whether the tool is ahead, in a word."""
        if self.ahead:
            return "surely" if self.surely else "yes"
        same = self.tool.wrong.value == self.baseline.wrong.value
        return "level" if same and self.tool.alarms.value <= self.baseline.alarms.value else "no"


def baseline_curves(
    truths: Mapping[str, ExamTruth],
    contents: Mapping[str, Content],
    development: tuple[Mapping[str, ExamTruth], Mapping[str, Content]] | None = None,
) -> tuple[Curve, ...]:
    """Return the curves of the tool, first, and of every baseline that had something to go by.

    Parameters
    ----------
    contents : mapping
        Answers' files by the id of the recording.
    development : tuple of (truths, contents), optional
        What the random forest is trained on; without it there is none.

    Raises
    ------
    ImportError
        `development` is given, and scikit-learn is not installed.
    """
    rules: dict[str, Rule] = {TOOL: tool, **RULES}
    trained = forest(*development) if development is not None else None
    if trained is not None:
        rules[FOREST] = trained
    asked = [i for i in contents if i in truths]
    made = []
    for name, rule in rules.items():
        picks = {i: rule(contents[i]) for i in asked}
        if name == TOOL or any(p is not None for p in picks.values()):
            made.append(curve(name, [(truths[i], p) for i, p in picks.items()]))
    return tuple(made)


def curve(name: str, picks: Sequence[tuple[ExamTruth, Pick | None]]) -> Curve:
    """Count what is told at every setting of the knob."""
    able = [p for t, p in picks if any(e.names for e in t.effects)]
    empty = [p for t, p in picks if not any(e.names for e in t.effects)]
    given = [(t, p) for t, p in picks if p is not None]
    made = []
    for limit in sorted({p.knob for _, p in given}, reverse=True) or [()]:
        told = [(t, p) for t, p in given if p.knob >= limit and any(e.names for e in t.effects)]

        def share(of: Sequence[Pick | None], limit: tuple[float, ...] = limit) -> Rate:
            return rate(p is not None and p.knob >= limit for p in of)

        made.append(
            Counted(
                share(able),
                rate(not any(p.name in e.names for e in t.effects) for t, p in told),
                rate(not any(p.places & e.places for e in t.effects) for t, p in told if p.places),
                share(empty),
            )
        )
    return Curve(name, tuple(made))


def at_equal_coverage(curves: Sequence[Curve]) -> tuple[EqualCoverage, ...]:
    """Hold every baseline against the tool where both name as many, and at half of that."""
    own, *others = curves
    found = []
    for other in others:
        most = min(c.counts[-1].named.value for c in (own, other))
        for part in PARTS:
            if most > 0:
                c = part * most
                found.append(EqualCoverage(other.name, c, own.at(c), other.at(c)))
    return tuple(found)


def statement(found: Sequence[EqualCoverage]) -> str:
    """Return in a sentence of which baselines the tool is ahead at the largest equal coverage."""
    most: dict[str, EqualCoverage] = {}
    for e in found:
        if e.name not in most or e.coverage > most[e.name].coverage:
            most[e.name] = e
    ahead = [e for e in most.values() if e.ahead]
    behind = [e.name for e in most.values() if not e.ahead]
    return (
        f"at equal coverage the tool is ahead of {len(ahead)} of {len(most)} baselines, "
        f"with intervals that do not meet of {sum(e.surely for e in ahead)}"
        + (f"; not of {', '.join(behind)}" if behind else "")
    )


HEADS = (
    "baseline", "coverage", "its wrong names", "the tool's", "its names where there is none",
    "the tool's", "tool ahead",
)  # fmt: skip


def ahead_rows(found: Sequence[EqualCoverage]) -> list[tuple[str, ...]]:
    """Return what `at_equal_coverage` found in words, a row each under `HEADS`."""
    return [
        (e.name, f"{100 * e.coverage:.0f} %", *map(_text, (
            e.baseline.wrong, e.tool.wrong, e.baseline.alarms, e.tool.alarms
        )), e.words)
        for e in found
    ]  # fmt: skip


def ahead_lines(found: Sequence[EqualCoverage]) -> list[str]:
    """Return the same as a table in Markdown."""
    return markdown(HEADS, ahead_rows(found)).split("\n")


def _text(r: Rate) -> str:
    low, high = r.exact
    return f"{r.hits}/{r.total} ({100 * low:.1f} to {100 * high:.1f} %)"
