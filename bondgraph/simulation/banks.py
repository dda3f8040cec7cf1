"""Laws that are sums of plays, with their plays taken out, for a native loop to run.

At a place a bank of plays is, until the next one moves or rests, a line: its sum there, its slope
and the place. What is left of such a law has these three numbers a bank for a memory, however many
plays there are, and gives back where the bank was read: Newton's method on the lines is that on the
plays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import files
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from bondgraph.hysteresis.plays.kernels import play_source
from bondgraph.laws.law import Law, split
from bondgraph.support.arrays import Array
from bondgraph.support.ops import CASADI, Ops

BANKED_FROM = 4
"""Plays of a law from which a loop over them beats closed code."""

LINE = 3
"""Numbers of a bank in the memory of what is left: sum, slope, place."""

BUILT_IN = 8
"""Plays that a loop takes side by side, or a divisor of them."""


@dataclass(frozen=True)
class Bank:
    """The plays of one law that see one signal.

    Attributes
    ----------
    plays : slice
        Of the law's memory.
    stops : bool
        Whether each stands for the input less the play.
    numbers : casadi.Function
        ``q -> (half widths, weights)`` of the law's parameters, each of shape (n,).
    slopes : casadi.Function or None
        Their derivatives by q, one below the other, shape (2 n, n_q); None if they are constant.
    """

    plays: slice
    stops: bool
    numbers: ca.Function
    slopes: ca.Function | None

    @property
    def count(self) -> int:
        """How many plays."""
        return int(self.plays.stop - self.plays.start)

    @cached_property
    def _constant(self) -> Array:
        return self._numbers(np.zeros(self.numbers.numel_in(0)))

    def _numbers(self, q: Array) -> Array:
        numbers = np.zeros((2, -(-self.count // BUILT_IN) * BUILT_IN))
        numbers[:, : self.count] = np.hstack([v.full() for v in self.numbers(q)]).T
        return numbers

    def filled(self, q: Array, dq: Array, lanes: int) -> tuple[Array, Array]:
        """Return half widths and weights in whole eights, and rows of their derivatives.

        Returns
        -------
        numbers : ndarray, shape (2, n)
            n is the count, rounded up to eights.
        rows : ndarray, shape (2, n, lanes)
            Derivatives along the columns of `dq` (n_q, n_d), in lanes from the second on; without
            rows where they are constant.
        """
        numbers = self._constant if self.slopes is None else self._numbers(q)
        n = numbers.shape[1]
        if self.slopes is None or not dq.any():
            return numbers, np.zeros((2, 0, lanes))
        rows = np.zeros((2, n, lanes))
        moved = np.asarray(self.slopes(q).full() @ dq).reshape(2, self.count, -1)
        rows[:, : self.count, 1 : 1 + dq.shape[1]] = moved
        return numbers, rows


@dataclass(frozen=True)
class BankedLaw(Law):
    """What is left of a law whose plays a loop runs: memory of `LINE` numbers a bank."""

    law: Law
    banks: int
    name: ClassVar[str] = "banked"

    @property
    def n_memory(self) -> int:
        """Sum, slope and place of each bank."""
        return LINE * self.banks

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """No line yet."""
        return (0.0,) * self.n_memory

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Deviation of the law, every bank on its line."""
        return self._read(ops, s, memory, p)[0]

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Sum and slope as they are, and where each bank was read."""
        places = self._read(ops, s, memory, p)[1]
        each = enumerate(places)
        return tuple(v for k, place in each for v in (*memory[LINE * k : LINE * k + 2], place))

    def _read(
        self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]
    ) -> tuple[Any, list[Any]]:
        places: list[Any] = []

        def line(x: Any, r: Any, w: Any, y: Any, stops: bool) -> Any:
            total, slope, place = memory[LINE * len(places) :][:LINE]
            places.append(x)
            return total + slope * (x - place)

        states = (0.0,) * self.law.n_memory
        return self.law.deviation(replace(ops, bank=line), s, states, p), places


def banks_of(law: Law, n_q: int) -> tuple[Bank, ...]:
    """Return the banks that are the whole memory of a law with `n_q` parameters, or nothing."""
    plain = not (law.timed or law.flows or law.watched or law.closed or law.set_valued)
    if not plain or law.n_memory < BANKED_FROM or type(law).solve is not Law.solve:
        return ()
    s, m, q = ca.SX.sym("s"), ca.SX.sym("m", law.n_memory), ca.SX.sym("q", n_q)
    at = {v.name(): i for i, v in enumerate(split(m))}
    found: list[Bank] = []
    foreign: list[Any] = []

    def taken(x: Any, r: Any, w: Any, y: Sequence[Any], stops: bool) -> Any:
        rows = [at.get(v.name(), -1) if v.is_symbolic() else -1 for v in map(ca.SX, y)]
        start = sum(bank.count for bank in found)
        if rows != list(range(start, start + len(rows))):
            foreign.append(m)
        widths, weights = ca.SX(ca.vertcat(*r)), ca.SX(ca.vertcat(*w))
        if ca.depends_on(ca.vertcat(widths, weights), ca.vertcat(s, m)):
            foreign.append(m)
            return x
        found.append(_bank(slice(start, start + len(rows)), stops, q, widths, weights))
        return ca.SX.sym("sum") + x

    value = law.deviation(replace(CASADI, bank=taken), s, split(m), split(q))
    whole = sum(bank.count for bank in found) == law.n_memory
    if foreign or not whole or ca.depends_on(ca.SX(value), m):
        return ()
    return tuple(found)


def _bank(plays: slice, stops: bool, q: ca.SX, widths: ca.SX, weights: ca.SX) -> Bank:
    both = ca.densify(ca.vertcat(widths, -weights if stops else weights))
    numbers = ca.Function("numbers", [q], [both[: widths.numel()], both[widths.numel() :]])
    slope = ca.jacobian(both, q)
    slopes = ca.Function("slopes", [q], [slope]) if slope.nnz() else None
    return Bank(plays, stops, numbers, slopes)


def bank_source() -> str:
    """C source of banks within a step; who includes it names its rows, see `banks.c`."""
    return play_source() + files("bondgraph.simulation").joinpath("banks.c").read_text()


@dataclass(frozen=True)
class PlacedBank:
    """A bank among all laws of a model.

    Attributes
    ----------
    bank : Bank
    states : slice
        Its plays in the memory of the model.
    slot : int
        Where its line begins in the memory that is left.
    parameters : slice
        Those of its law among the parameters of all laws.
    """

    bank: Bank
    states: slice
    slot: int
    parameters: slice


@dataclass(frozen=True)
class TakenOut:
    """The laws of a model without their banks.

    Attributes
    ----------
    laws : tuple of Law
    banks : tuple of PlacedBank
    kept, left : tuple of int
        Positions of what is no play in the memory of the model, and in the memory that is left.
    """

    laws: tuple[Law, ...]
    banks: tuple[PlacedBank, ...]
    kept: tuple[int, ...]
    left: tuple[int, ...]


def taken_out(laws: Sequence[tuple[Law, int]]) -> TakenOut:
    """Take the banks out of laws, given with the number of their parameters, in order."""
    remain: list[Law] = []
    banks: list[PlacedBank] = []
    kept: list[int] = []
    left: list[int] = []
    m = slot = q = 0
    for law, n_q in laws:
        found = banks_of(law, n_q)
        for k, bank in enumerate(found):
            states = slice(m + bank.plays.start, m + bank.plays.stop)
            banks.append(PlacedBank(bank, states, slot + LINE * k, slice(q, q + n_q)))
        remain.append(BankedLaw(law, len(found)) if found else law)
        if not found:
            kept += range(m, m + law.n_memory)
            left += range(slot, slot + law.n_memory)
        m, slot, q = m + law.n_memory, slot + remain[-1].n_memory, q + n_q
    return TakenOut(tuple(remain), tuple(banks), tuple(kept), tuple(left))


def loaded(
    banks: tuple[PlacedBank, ...], filled: list[tuple[Array, Array]], plays: Array, lanes: int
) -> tuple[Array, Array, Array]:
    """Return sizes, numbers and rows of all banks as `banks.c` takes them."""
    start, sizes, numbers, rows = 0, [], [np.zeros(0)], [np.zeros(0)]
    for placed, (own, slopes) in zip(banks, filled, strict=True):
        count, n = placed.bank.count, own.shape[1]
        states, moved = np.zeros((3, n)), np.zeros((n, lanes))
        states[0, :count] = plays[start : start + count, 0]
        moved[:count, 1 : plays.shape[1]] = plays[start : start + count, 1:]
        sizes.append((n, slopes.size > 0))
        numbers += [own.ravel(), states.ravel()]
        rows += [moved.ravel(), slopes.ravel()]
        start += count
    return np.array(sizes, np.int64), np.concatenate(numbers), np.concatenate(rows)


def unloaded(
    banks: tuple[PlacedBank, ...], sizes: Array, numbers: Array, rows: Array, width: int
) -> Array:
    """Return the plays after the run and their derivatives, shape (plays, width)."""
    found, at, row = [np.zeros((0, width))], 0, 0
    lanes = rows.size // max(sum(n * (3 if moving else 1) for n, moving in sizes.tolist()), 1)
    for placed, (n, moving) in zip(banks, sizes.tolist(), strict=True):
        count = placed.bank.count
        states = rows[row : row + n * lanes].reshape(n, lanes)[:count, :width].copy()
        states[:, 0] = numbers[at + 2 * n : at + 2 * n + count]
        found.append(states)
        at, row = at + 5 * n, row + n * lanes * (3 if moving else 1)
    return np.concatenate(found)
