"""The exact equations of any bond graph: ordered assignments, closed forms, what is implicit.

States keep their natural coordinates: displacements ``q_`` and momenta ``p_`` of the storages with
integral causality. Dependent storages, linear loops and derivatives of inputs are solved; what
cannot be solved in closed form stays as algebraic unknowns with residuals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import sympy as sp

from bondgraph.causality.assignment import Causality
from bondgraph.equations.closed_forms import (
    Closing,
    deviation_formula,
    law_function,
    rest_terms,
)
from bondgraph.equations.decimals import as_text
from bondgraph.equations.refusals import AlgebraicLoop, NotLinearUpToLaws
from bondgraph.equations.relation import LawUse, Relation, StoredState
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.errors import UnusableInput, require_known, unknown_name

if TYPE_CHECKING:
    from bondgraph.analysis.linear import Linearised
    from bondgraph.drawing.panels import Panels
    from bondgraph.equations.program import Program
    from bondgraph.simulation.lure import Compiled

_OUTSIDE = ("time",)
LONGEST = 160
"""Characters of a formula that is read at a glance."""


@dataclass(frozen=True, slots=True)
class Algebraic:
    """An unknown that only a numerical solution gives: ``0 = residual``.

    Attributes
    ----------
    name : str
        The signal (or dependent store) that is guessed.
    residual : Relation
        Its implicit relation, evaluated after the assignments.
    reason : str
        Which elements form the loop.
    """

    name: str
    residual: Relation
    reason: str


@dataclass(frozen=True, repr=False)
class System:
    """``dx/dt = f(x, z, u, du/dt, p)``, ``0 = g(..)``, ``y = h(..)``.

    Attributes
    ----------
    name : str
    graph : BondGraph
        What it was derived from, in its mode.
    stored : tuple of StoredState
        Independent states with the signals that are their rates.
    inputs : tuple of str
        Commands of the sources, external signals and pseudo-inputs (``one``, ``ramp``).
    input_rates : tuple of str
        ``d_NAME`` (second derivatives ``d2_NAME``) that the equations need.
    readings : tuple of (str, str, str)
        Sensor, signal and unit.
    relations : tuple of Relation
        Explicit assignments in order of evaluation.
    algebraic : tuple of Algebraic
        Unknowns of nonlinear loops and of dependent stores with nonlinear laws.
    laws : tuple of LawUse
        Nonlinear laws that the relations refer to by position.
    held : dict of str to str
        Dependent store to the storage it belongs to.
    loops : tuple of tuple of str
        Signals of every algebraic loop that was solved or left implicit.
    parameters : dict of str to Parameter
    causality : Causality
    aliases : dict of str to str
        Second names: ``f_R_1`` of a resistor whose flow is named after its junction.
    recorded : tuple of str
        The input rates of sources that are recorded by their integral, see
        `bondgraph.signals.recorded_rates`.

    Examples
    --------
    >>> exact = equations(graph)
    >>> exact.states, exact.inputs
    (('p_m', 'q_k'), ('F',))
    >>> exact.transfer_function("F", "x")
    1/(d*s + k + m*s**2)
    """

    name: str
    graph: BondGraph
    stored: tuple[StoredState, ...]
    inputs: tuple[str, ...]
    input_rates: tuple[str, ...]
    readings: tuple[tuple[str, str, str], ...]
    relations: tuple[Relation, ...]
    algebraic: tuple[Algebraic, ...]
    laws: tuple[LawUse, ...]
    held: Mapping[str, str]
    loops: tuple[tuple[str, ...], ...]
    parameters: dict[str, Parameter]
    causality: Causality
    aliases: Mapping[str, str]
    recorded: tuple[str, ...] = ()

    # -- sizes and names ----------------------------------------------------------------------
    @property
    def states(self) -> tuple[str, ...]:
        """Names of the independent states."""
        return tuple(s.name for s in self.stored)

    @property
    def order(self) -> int:
        """Number of independent states."""
        return len(self.stored)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the sensors."""
        return tuple(n for n, _, _ in self.readings)

    @cached_property
    def index(self) -> dict[str, int]:
        """Position of the assignment of every signal."""
        return {r.target: i for i, r in enumerate(self.relations)}

    def values(self, changed: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return the values of all parameters: the declared ones, or those in `changed`."""
        found: dict[str, Any] = {n: p.value for n, p in self.parameters.items()}
        for n, v in (changed or {}).items():
            require_known("parameter", self.name, found, n)
            found[n] = v
        return found

    # -- closed forms -------------------------------------------------------------------------
    @cached_property
    def _closing(self) -> Closing:
        given = {r.target: r for r in self.relations}
        return Closing(given, self.laws, self.parameters, beside=True)

    @cached_property
    def _showing(self) -> Closing:
        return replace(self._closing, whole=True)

    def signal(self, name: str) -> sp.Expr:
        """Return a signal in states, inputs, parameters (and algebraic unknowns).

        Raises
        ------
        UnknownName
        """
        return self._closing(self.called(name))

    def called(self, name: str) -> str:
        """Return the name under which the relations know a signal.

        Raises
        ------
        UnknownName
        """
        found = name if name in self.signals else self.aliases.get(name, name)
        if found not in self.signals:
            raise unknown_name("signal", name, self.name, [*self.index, *self.signals])
        return found

    def shown(self, what: str | Relation) -> sp.Expr:
        """Return the closed form of a signal or relation, every law a function by its element."""
        if isinstance(what, Relation):
            return self._showing.value(what)
        return self._showing(self.called(what))

    @cached_property
    def signals(self) -> frozenset[str]:
        """Names of all signals: states, inputs and their rates, unknowns, and what is assigned."""
        unknowns = (a.name for a in self.algebraic)
        return frozenset(
            (*self.index, *self.states, *self.inputs, *self.input_rates, *unknowns, *_OUTSIDE)
        )

    @property
    def rates(self) -> tuple[sp.Expr, ...]:
        """Closed ``dx/dt``, shape (n_x,)."""
        return tuple(self.signal(s.rate) for s in self.stored)

    @property
    def outputs(self) -> tuple[sp.Expr, ...]:
        """Closed readings of the sensors, shape (n_y,)."""
        return tuple(self.signal(s) for _, s, _ in self.readings)

    @property
    def residuals(self) -> tuple[sp.Expr, ...]:
        """Closed residuals of the algebraic unknowns, shape (n_z,)."""
        return tuple(self._closing.value(a.residual) for a in self.algebraic)

    @property
    def dependent(self) -> dict[str, sp.Expr]:
        """Closed form of every dependent store."""
        return {name: self.signal(name) for name in self.held}

    @property
    def is_explicit(self) -> bool:
        """Whether nothing is left to be solved numerically."""
        return not self.algebraic

    # -- analysis -----------------------------------------------------------------------------
    @cached_property
    def lure(self) -> Compiled | None:
        """The linear rest with scalar laws around it; None where there is none."""
        from bondgraph.simulation.lure import exact_form, lure_of

        if self.held:  # in coordinates without dependent stores
            return exact_form(self.graph)
        try:
            return lure_of(self)
        except (AlgebraicLoop, NotLinearUpToLaws):
            return None

    def linearise(self, at: Mapping[str, float] | None = None) -> Linearised:
        """Return the symbolic linear system at an operating point, see `analysis.linear`."""
        from bondgraph.analysis.linear import linearise

        return linearise(self, at)

    def transfer_function(self, source: str, signal: str) -> sp.Expr:
        """Return the transfer function from an input to any signal, rational in ``s``."""
        from bondgraph.analysis.linear import transfer_function

        return transfer_function(self, source, signal)

    def eigenvalues(self, values: Mapping[str, float] | None = None) -> Any:
        """Return the eigenvalues at parameter `values` (nominal where not given), shape (n_x,)."""
        from bondgraph.analysis.linear import eigenvalues

        return eigenvalues(self, values)

    def program(self) -> Program:
        """Return the executable form, see `bondgraph.equations.codegen`."""
        from bondgraph.equations.codegen import exported

        return exported(self)

    # -- showing ------------------------------------------------------------------------------
    def right_side(self, r: Relation) -> sp.Expr:
        """Return what a relation gives (or its residual) in signals, its law as a function."""
        use = None if r.law is None else self.laws[r.law]
        parts = [sp.Mul(c, symbol(s)) for c, s in rest_terms(r, use)]
        parts += [] if r.expression is None else [r.expression]
        return sp.Add(*parts, *([] if use is None else [_named_law(r, use)]))

    @property
    def formulas(self) -> tuple[str, ...]:
        """Laws that stand as functions in what is shown, as text; those with a short formula."""
        lines = []
        for r in (*self.relations, *(a.residual for a in self.algebraic)):
            use = None if r.law is None else self.laws[r.law]
            made = None if use is None else self._formula(r, use)
            if use is not None and made is not None and len(made) <= LONGEST:
                lines.append(f"{made}    (law {use.law.name} of {use.element})")
        return tuple(lines)

    def _formula(self, r: Relation, use: LawUse) -> str | None:
        argument = symbol(use.argument)
        deviation = deviation_formula(use, self.parameters, argument)
        if deviation is None:
            return None
        slope = 0 if r.target == f"w_{use.element}" else use.slope
        halves = {f: 2 * float(f) for f in deviation.atoms(sp.Float)}
        plain = {f: sp.Rational(int(n), 2) for f, n in halves.items() if n.is_integer()}
        told = slope * argument + sp.factor_terms(deviation.xreplace(plain))
        return f"{as_text(_named_law(r, use))} = {as_text(told)}"

    def __repr__(self) -> str:
        """Name, states, inputs and readings."""
        return f"System({self.name!r}, {self.states}, {self.inputs}, {self.output_names})"

    def __str__(self) -> str:
        """Ordered assignments, rates, residuals and outputs as text."""
        lines = [
            f"{r.target} := {as_text(self.right_side(r))}    ({r.reason})" for r in self.relations
        ]
        lines += [f"0 = {as_text(self.right_side(a.residual))}    (unknown {a.name}: {a.reason})"
                  for a in self.algebraic]  # fmt: skip
        lines += [f"d{s.name}/dt := {s.rate}" for s in self.stored]
        lines += [f"{n} := {s}" for n, s, _ in self.readings]
        return "\n".join([*lines, *self.formulas])

    def plot(self) -> Panels:
        """Draw the frequency responses at the nominal values, linearised about zero.

        Returns
        -------
        Panels of matplotlib Axes, shape (2 n_y, n_u)
            Magnitude and phase of each reading, a column an input.

        Raises
        ------
        UnusableInput
            The equations have no derivative there, or there is no input or no reading.
        """
        from bondgraph.drawing.responses import responses

        made = self.linearise()
        if not made.inputs or not made.outputs:
            lacks = "source (Se, Sf)" if made.outputs else "sensor (De, Df, Dq)"
            raise UnusableInput(
                f"{self.graph.name} has no {lacks}: there is no frequency response to draw; add "
                "one, or draw a run: simulate(graph, time).plot()"
            )
        numbers = made.numbers({n: p.value for n, p in self.parameters.items()})
        units = {n: getattr(e, "unit", "") for n, e in self.graph.elements.items()}
        return responses(numbers, made.inputs, made.outputs, units)

    def to_pandas(self) -> Any:
        """Return one row a relation: what it gives, how, and why (needs pandas)."""
        from bondgraph.signals.files.checks import optional

        pandas = optional("pandas", "to_pandas", "tables")
        rows = [(r.target, as_text(self.right_side(r)), r.reason) for r in self.relations]
        rows += [(f"0 ({a.name})", as_text(self.right_side(a.residual)), a.reason)
                 for a in self.algebraic]  # fmt: skip
        rows += [(f"d{s.name}/dt", s.rate, f"state of {s.element}") for s in self.stored]
        rows += [(n, s, f"reading, {unit}" if unit else "reading") for n, s, unit in self.readings]
        names = ["name", "expression", "reason"]
        return pandas.DataFrame(rows, columns=names).set_index("name")

    def _repr_latex_(self) -> str:
        """Return the closed equations for notebooks."""
        from bondgraph.export.latex import latex

        return "$$" + latex(self) + "$$"


def _named_law(r: Relation, use: LawUse) -> sp.Expr:
    """Return the law of a relation as a function of its argument, and of what it watches."""
    signals = (use.argument, use.law.watched) if use.law.watched else (use.argument,)
    return law_function(r, use)(*map(symbol, signals))
