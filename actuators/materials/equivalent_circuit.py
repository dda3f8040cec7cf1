"""The equivalent circuit of a resonating ceramic (stack actuator thesis, fig. 2.5 and 2.6).

A capacitance ``C_0`` in parallel with one series branch L-R-C for each mode (Butterworth, Van
Dyke; IEEE Std 176). The series resonance of a branch and the antiresonance of the circuit belong
to the lossless circuit; `actuators.materials.resonance` gives the frequencies of the circuit with
losses and the coupling factors that follow from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph import BondGraph, C, De, Df, I, One, R, Se, Sf, Zero
from bondgraph.support.errors import UnusableInput, require_positive

ComplexArray: TypeAlias = NDArray[np.complex128]


@final
@dataclass(frozen=True, slots=True)
class Branch:
    """One mode: L (H), R (ohm) and C (F) in series.

    Examples
    --------
    >>> branch = Branch.from_resonance(18e3, 50.0, 1e-7)
    >>> round(branch.resonance), round(branch.quality)
    (18000, 50)
    """

    inductance: float
    resistance: float
    capacitance: float

    def __post_init__(self) -> None:
        """Refuse values that are not positive."""
        require_positive(
            "branch", inductance=self.inductance, resistance=self.resistance,
            capacitance=self.capacitance,
        )  # fmt: skip

    @classmethod
    def from_resonance(cls, frequency: float, quality: float, capacitance: float) -> Branch:
        """Return the branch with a series resonance (Hz), quality factor and capacitance (F)."""
        require_positive("branch", frequency=frequency, quality=quality, capacitance=capacitance)
        omega = 2 * pi * frequency
        return cls(1 / (omega**2 * capacitance), 1 / (quality * omega * capacitance), capacitance)

    @property
    def resonance(self) -> float:
        """Series resonance ``1/(2 pi sqrt(L C))``, Hz."""
        return 1 / (2 * pi * sqrt(self.inductance * self.capacitance))

    @property
    def quality(self) -> float:
        """Mechanical quality factor ``sqrt(L/C)/R``."""
        return sqrt(self.inductance / self.capacitance) / self.resistance

    def impedance(self, frequency: ArrayLike) -> ComplexArray:
        """Return the impedance of the branch alone, ohm, at `frequency` (Hz, any shape)."""
        s = 2j * pi * np.asarray(frequency, dtype=np.float64)
        return np.asarray(s * self.inductance + self.resistance + 1 / (s * self.capacitance))


@final
@dataclass(frozen=True, slots=True)
class EquivalentCircuit:
    """``C_0`` in parallel with series branches, one a mode, in the order of their resonances.

    Parameters
    ----------
    capacitance : float
        ``C_0``, F: of the ceramic clamped far above all modes.
    branches : tuple of Branch
        At least one.

    Examples
    --------
    >>> from actuators.materials.equivalent_circuit import Branch
    >>> circuit = EquivalentCircuit(1e-6, (Branch.from_resonance(18e3, 50.0, 1e-7),))
    >>> [round(f) for f in circuit.resonances]
    [18000]
    """

    capacitance: float
    branches: tuple[Branch, ...]

    def __post_init__(self) -> None:
        """Check the values and put the modes in order."""
        require_positive("circuit", capacitance=self.capacitance)
        if not self.branches:
            raise UnusableInput(
                "circuit: no branch is given; a resonating ceramic has at least one"
            )
        ordered = tuple(sorted(self.branches, key=lambda b: b.resonance))
        object.__setattr__(self, "branches", ordered)

    @property
    def low_frequency_capacitance(self) -> float:
        """``C_0`` and all branches, F: the free ceramic far below its modes."""
        return self.capacitance + sum(b.capacitance for b in self.branches)

    def admittance(self, frequency: ArrayLike) -> ComplexArray:
        """Return ``Y = i w C_0 + sum 1/Z_branch``, S, at `frequency` (Hz > 0, any shape)."""
        f = np.asarray(frequency, dtype=np.float64)
        if not (f > 0).all():
            raise UnusableInput("circuit: frequencies must be positive; leave out f = 0")
        y = 2j * pi * f * self.capacitance
        for b in self.branches:
            y = y + 1 / b.impedance(f)
        return np.asarray(y)

    def impedance(self, frequency: ArrayLike) -> ComplexArray:
        """Return ``Z = 1/Y``, ohm, at `frequency` (Hz > 0, any shape)."""
        return np.asarray(1 / self.admittance(frequency))

    @property
    def resonances(self) -> tuple[float, ...]:
        """Series resonances, Hz, rising."""
        return tuple(b.resonance for b in self.branches)

    @property
    def antiresonances(self) -> tuple[float, ...]:
        """Parallel resonances of the lossless circuit, Hz, rising: one above each resonance.

        The zeros of ``C_0 + sum C_i w_i^2/(w_i^2 - w^2)`` are the eigenvalues of
        ``diag(w_i^2) + v v^T / C_0`` with ``v_i = w_i sqrt(C_i)``. For one mode
        ``f_a = f_r sqrt(1 + C/C_0)``.
        """
        omega = 2 * pi * np.array(self.resonances)
        v = omega * np.sqrt([b.capacitance for b in self.branches])
        squares = np.linalg.eigvalsh(np.diag(omega**2) + np.outer(v, v) / self.capacitance)
        return tuple((np.sqrt(squares) / (2 * pi)).tolist())


def circuit_graph(
    circuit: EquivalentCircuit, *, source_resistance: float | None = None
) -> BondGraph:
    """Return the circuit as a bond graph: input current ``i``, output voltage ``v``.

    Parameters
    ----------
    circuit : EquivalentCircuit
    source_resistance : float, optional
        Drive with a voltage ``V_in`` behind this resistance (ohm) instead and read the current
        too. A bare voltage source would impose the charge of ``C_0``.

    Returns
    -------
    BondGraph
        ``C_0`` and ``L_1``, ``R_1``, ``C_1``, ``L_2``, ... of the modes.
    """
    with BondGraph("equivalent_circuit") as g:
        terminals = Zero("terminals")
        if source_resistance is None:
            Sf("i", unit="A") >> terminals
        else:
            loop = One("loop")
            Se("V_in", unit="V") >> loop >> R("R_s", source_resistance, unit="ohm")
            loop >> terminals
            loop >> Df("i", unit="A")
        terminals >> C("C_0", circuit.capacitance, unit="F")
        for n, b in enumerate(circuit.branches, start=1):
            mode = One(f"mode_{n}")
            terminals >> mode >> I(f"L_{n}", b.inductance, unit="H")
            mode >> R(f"R_{n}", b.resistance, unit="ohm")
            mode >> C(f"C_{n}", b.capacitance, unit="F")
        terminals >> De("v", unit="V")
    return g
