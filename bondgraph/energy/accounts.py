"""The value of an energy ledger: accounts of elements, totals, what is left over, and tables.

Sizes: N samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.energy.bond_values import BondPower
from bondgraph.support.errors import unknown_name
from bondgraph.support.html import html_table
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True)
class EnergyEntry:
    """The account of one element.

    Attributes
    ----------
    element, kind : str
    role : {"source", "store", "loss", "two-port", "junction", "signal"}
        ``signal``: behind an RS of the pseudo thermal domain ``e f`` is no power; not counted.
    power : ndarray, shape (N,), W
        Into the element, summed over its ports.
    work : ndarray, shape (N,), J
        Its integral since the start.
    stored : ndarray, shape (N,), J, or None
        Energy held, from the state; None where it holds none or none is known.
    lost : ndarray, shape (N,), J
        Since the start.
    note : str
    """

    element: str
    kind: str
    role: str
    power: FloatArray
    work: FloatArray
    stored: FloatArray | None
    lost: FloatArray
    note: str = ""

    @property
    def open(self) -> FloatArray:
        """Work that nothing accounts for: kept or lost inside a law without an energy, J."""
        if self.role == "store" and self.stored is None:
            return self.work
        return np.zeros_like(self.work)


@dataclass(frozen=True)
class Ledger:
    """Energy of a whole motion; times and energies in SI.

    Attributes
    ----------
    name : str
    time : ndarray, shape (N,), s
    bonds : tuple of BondPower
    entries : tuple of EnergyEntry
        In the order of declaration.
    supplied, stored, lost, open : ndarray, shape (N,), J
        By sources since the start; change of what stores hold; lost; work of laws without energy.
    residual : ndarray, shape (N,), J
        ``supplied - stored - lost - open``: errors of integrator and quadrature.
    throughput : float
        Energy that changed hands: half the integral of all ``|power|`` at sources, stores and
        losses, J.
    imbalance : float
        Largest sum of the powers of a junction or two-port at any sample, over the largest power
        of its bonds: rounding only.
    accuracy : float
        What the integrator was asked for (the default of `simulate` if not said).
    quadrature : float
        Estimate of the error of the integrals of power, over the throughput.
    """

    name: str
    time: FloatArray
    bonds: tuple[BondPower, ...]
    entries: tuple[EnergyEntry, ...]
    supplied: FloatArray
    stored: FloatArray
    lost: FloatArray
    open: FloatArray
    residual: FloatArray
    throughput: float
    imbalance: float
    accuracy: float
    quadrature: float

    @property
    def relative_residual(self) -> float:
        """Largest residual over the throughput."""
        return float(np.abs(self.residual).max()) / self.throughput if self.throughput else 0.0

    @property
    def closes(self) -> bool:
        """Whether the residual is within what integrator and quadrature explain."""
        return self.relative_residual <= max(10.0 * self.accuracy, 2.0 * self.quadrature, 1e-12)

    def __getitem__(self, element: str) -> EnergyEntry:
        """Account by element."""
        for e in self.entries:
            if e.element == element:
                return e
        raise unknown_name("element", element, self.name, [e.element for e in self.entries])

    def bond(self, name: str) -> BondPower:
        """Bond by its name, such as ``loop>R_e``."""
        for b in self.bonds:
            if b.name == name:
                return b
        raise unknown_name("bond", name, self.name, [b.name for b in self.bonds])

    def rows(self) -> tuple[tuple[str, str, float, float, float, str], ...]:
        """Element, kind, supplied, kept and lost energy at the end, note; largest first."""
        found = []
        for e in self.entries:
            if e.role in ("junction", "two-port"):
                continue
            supplied = -float(e.work[-1]) if e.role == "source" else 0.0
            kept = 0.0 if e.stored is None else float(e.stored[-1] - e.stored[0])
            note = "e f is no power" if e.role == "signal" else e.note
            found.append((e.element, e.kind, supplied, kept, float(e.lost[-1]), note))
        return tuple(sorted(found, key=lambda r: -max(map(abs, r[2:5]))))

    def _summary(self) -> str:
        return (
            f"residual {self.relative_residual:.1e} of the throughput {self.throughput:.3g} J "
            f"(integrator asked for {self.accuracy:.0e}, quadrature {self.quadrature:.1e}); "
            f"junctions and two-ports balance to {self.imbalance:.0e}"
        )

    def __str__(self) -> str:
        """Table of energies at the end, largest first."""
        width = max([8, *(len(e.element) for e in self.entries)])
        head = f"{'element':{width}} kind {'supplied':>12} {'stored':>12} {'lost':>12}  J"
        lines = [head, "-" * len(head)]
        for name, kind, *energies, note in self.rows():
            line = f"{name:{width}} {kind:4} " + " ".join(f"{v:12.5g}" for v in energies)
            lines.append(f"{line}  {note}".rstrip())
        total = (self.supplied[-1], self.stored[-1], self.lost[-1])
        lines.append(f"{'sum':{width}} {'':4} " + " ".join(f"{v:12.5g}" for v in total))
        if np.any(self.open):
            lines.append(f"kept or lost in laws without an energy: {self.open[-1]:.5g} J")
        lines.append(self._summary())
        return "\n".join(lines)

    def __repr__(self) -> str:
        """Short text."""
        return f"Ledger({self.name!r}, {self.time.size} samples, {self._summary()})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        head = ("element", "kind", "supplied / J", "stored / J", "lost / J", "")
        rows = (
            (name, kind, *(f"{v:.5g}" for v in energies), note)
            for name, kind, *energies, note in self.rows()
        )
        return html_table(f"{self.name}: {self._summary()}", head, rows)
