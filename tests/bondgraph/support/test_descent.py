"""The one loop of damped descents: when a step is taken, shortened, given up, and what ends it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bondgraph.support.arrays import Array
from bondgraph.support.descent import Damping, Ended, Trial, bounded_step, descend


@dataclass(frozen=True)
class At:
    x: Array
    cost: float


def rosenbrock(x: Array) -> tuple[Array, Array]:
    return (
        np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]]),
        np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]]),
    )


def at(x: Array) -> At:
    r, _ = rosenbrock(x)
    return At(x, float(r @ r))


def steps(here: At) -> Trial[At]:
    r, j = rosenbrock(here.x)

    def trial(damping: float, number: int) -> At:
        a = j.T @ j
        return at(here.x - np.linalg.solve(a + damping * np.diag(np.diag(a)), j.T @ r))

    return trial


def never(before: At, after: At) -> bool:
    return False


def small(before: At, after: At) -> bool:
    return before.cost - after.cost < 1e-12


def test_it_descends_a_curved_valley_and_never_rises() -> None:
    seen = [at(np.array([-1.2, 1.0]))]
    made = descend(seen[0], steps, Damping(), 200, small, taken=seen.append)
    assert made.ended is Ended.ARRIVED
    assert made.at.x == pytest.approx([1.0, 1.0], abs=1e-5)
    assert made.steps == len(seen) - 1
    costs = [s.cost for s in seen]
    assert costs == sorted(costs, reverse=True)
    assert made.at is seen[-1]


def test_a_step_is_shortened_until_it_helps() -> None:
    asked: list[tuple[float, int]] = []

    def steps_from(here: At) -> Trial[At]:
        def trial(damping: float, number: int) -> At | None:
            asked.append((damping, number))
            if damping < 0.5:
                return None if number == 0 else At(here.x, np.nan)  # cannot be computed
            return At(here.x, here.cost / 2.0)

        return trial

    law = Damping(start=0.01, less=4.0, more=10.0)
    made = descend(At(np.zeros(1), 1.0), steps_from, law, 2, never)
    assert made.ended is Ended.LIMIT
    assert made.at.cost == 0.25
    # 0.01 and 0.1 fail, 1 is taken; the next point begins with a quarter of it
    assert asked == [(0.01, 0), (0.1, 1), (pytest.approx(1.0), 2), (0.25, 0), (2.5, 1)]


@pytest.mark.parametrize("limit", [{"tries": 3}, {"most": 1.0}])
def test_where_nothing_helps_it_is_stuck_or_rescued_once(limit: dict[str, float]) -> None:
    tried = 0

    def steps_from(here: At) -> Trial[At]:
        def trial(damping: float, number: int) -> At:
            nonlocal tried
            tried += 1
            return At(here.x, here.cost + 1.0)

        return trial

    law = Damping(start=1e-2, more=10.0, **limit)  # type: ignore[arg-type]
    begin = At(np.zeros(1), 1.0)
    made = descend(begin, steps_from, law, 9, never)
    assert (made.ended, made.at, made.steps, tried) == (Ended.STUCK, begin, 0, 3)
    left = [At(np.ones(1), 0.5)]
    made = descend(
        begin, steps_from, law, 9, never, rescue=lambda here, why: left.pop() if left else None
    )
    assert (made.ended, made.at.cost, made.steps) == (Ended.STUCK, 0.5, 1)


def test_a_step_that_disappoints_keeps_its_damping_and_a_failure_begins_higher() -> None:
    asked: list[float] = []

    def steps_from(here: At) -> Trial[At]:
        def trial(damping: float, number: int) -> At:
            asked.append(damping)
            return At(here.x, here.cost / 2.0 if damping >= 1e-3 else np.inf)

        return trial

    law = Damping(start=1e-2, less=100.0, more=8.0, again=0.5)
    begin = At(np.zeros(1), 1.0)
    descend(begin, steps_from, law, 3, never)
    # taken, then a hundredth fails and half is tried, then a hundredth of that is taken
    assert asked == pytest.approx([1e-2, 1e-4, 0.5, 5e-3])
    asked.clear()
    descend(begin, steps_from, law, 3, never, trusted=lambda before, at: False)
    assert asked == pytest.approx([1e-2] * 3)


def test_a_cost_of_minus_infinity_is_no_misfit() -> None:
    law = Damping(tries=2)
    made = descend(
        At(np.zeros(1), 1.0), lambda here: lambda d, n: At(here.x, -np.inf), law, 3, never
    )
    assert made.ended is Ended.STUCK


def test_what_says_that_nothing_is_to_be_gained_has_arrived() -> None:
    made = descend(at(np.ones(2)), lambda here: lambda d, n: Ended.ARRIVED, Damping(), 5, never)
    assert (made.ended, made.steps) == (Ended.ARRIVED, 0)


def test_an_interrupt_passes_and_no_steps_are_none() -> None:
    def interrupted(here: At) -> Trial[At]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        descend(at(np.zeros(2)), interrupted, Damping(), 5, never)
    assert descend(at(np.zeros(2)), steps, Damping(), 0, never).ended is Ended.LIMIT


@pytest.mark.parametrize("scale", [1.0, 1e-11])
def test_a_step_within_bounds_is_the_best_one_there(scale: float) -> None:
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((30, 3)), rng.standard_normal(30)
    size = np.array([1.0, scale, 1.0])
    a = a / size
    free = np.full(3, np.inf)
    best = np.linalg.lstsq(a * size, b, rcond=None)[0] * size
    assert bounded_step(a, b, -free, free) == pytest.approx(best, rel=1e-8)
    low, high = -np.abs(best) / 2, np.abs(best) / 2
    low[2] = high[2] = 0.0
    held = bounded_step(a, b, low, high)
    assert ((low <= held) & (held <= high)).all()
    assert held[2] == 0.0
    # no point of a grid within the bounds is better
    shares = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 21)] * 2), axis=-1).reshape(-1, 2)
    tried = np.column_stack([low[:2] + shares * (high - low)[:2], np.zeros(len(shares))])
    costs = np.sum((tried @ a.T - b) ** 2, axis=1)
    assert np.sum((a @ held - b) ** 2) <= costs.min() * (1 + 1e-9)
