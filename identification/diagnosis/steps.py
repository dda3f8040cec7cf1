"""One effect after the other: screen, fit, decide, repair; then whether each is still needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from identification.diagnosis.decide import Decision, Thresholds, decide
from identification.diagnosis.effects import UNNAMED
from identification.diagnosis.leftover import Leftover, strongest
from identification.diagnosis.pasts import scene
from identification.diagnosis.probes import probes
from identification.diagnosis.repair import Base, base_of
from identification.diagnosis.scene import Scene
from identification.diagnosis.screening import Screened, screen
from identification.diagnosis.search import Options, Trial, blocks_of, finish, search
from identification.diagnosis.structure import Structure

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Step:
    """Decisions in order, with the scene and the screening they started from."""

    decisions: tuple[Decision, ...]
    scene: Scene
    ranking: tuple[Screened, ...]


def steps(
    base: Base,
    options: Options,
    limits: Thresholds,
    declared: float,
    classes: Structure,
    say: Progress,
) -> Step:
    """Look for one effect after another until nothing more shows."""
    decisions: list[Decision] = []
    first: tuple[Scene, tuple[Screened, ...]] | None = None
    for number in range(max(1, options.effects)):
        low = 0.12 + 0.8 * number / max(1, options.effects)
        say("screening every effect at every port", low)
        seen = scene(base.fit)
        ranked = screen(seen, probes(base.fit), (*options.catalogue, UNNAMED))
        if first is None:
            first = seen, tuple(ranked)
        decision = _step(base, seen, ranked, options, limits, declared, classes, say, low)
        decisions.append(decision)
        if decision.kind != "missing_physics" or decision.chosen is None:
            break
        base = base_of(decision.chosen.fit)
        declared = float("inf")
    assert first is not None
    return Step(tuple(decisions), *first)


def _step(
    base: Base,
    seen: Scene,
    ranked: list[Screened],
    options: Options,
    limits: Thresholds,
    declared: float,
    classes: Structure,
    say: Progress,
    low: float,
) -> Decision:
    nominal = base.fit.chi2("test")
    before = strongest(ranked, limits.leftover)
    span = 0.8 / max(1, options.effects)

    def tell(text: str, fraction: float) -> None:
        say(text, low + span * fraction)

    # at the floor, or without any pattern, there is nothing to explain
    if before.z < limits.z and nominal < 1.5 * max(1.0, limits.mismatch):
        return Decision(
            "explained", None, (), (), 0.0, 0.0,
            (f"held-out misfit {nominal:.3g} times the floor, no pattern in the residual",),
            left=before, nominal=nominal,
        )  # fmt: skip
    trials = search(seen, base.template, ranked, options, tell)
    trials = _finished(trials, options)

    def remaining(trial: Trial) -> Leftover:
        after = screen(scene(trial.fit), probes(trial.fit), (*options.catalogue, UNNAMED))
        return strongest(after, limits.leftover)

    return decide(
        nominal, blocks_of(base.fit), trials, limits, declared=declared,
        nominal_train=base.fit.chi2("train"), before=before, remaining=remaining,
        classes=classes,
    )  # fmt: skip


def _finished(trials: list[Trial], options: Options) -> list[Trial]:
    """Fit the best few to the end: those that the decision will compare."""
    if not trials:
        return trials
    best = min(t.train for t in trials)
    close = [t for t in trials if t.train < 1.5 * best][:4]
    done = [finish(t, options.final_iterations) for t in close]
    rest = [t for t in trials if not any(t is c for c in close)]
    return sorted([*done, *rest], key=lambda t: t.test)
