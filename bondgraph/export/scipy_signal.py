"""Program -> scipy.signal.StateSpace, with the names SciPy does not keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bondgraph.equations.program import Program
from bondgraph.export.linear import linear_model


@dataclass(frozen=True)
class NamedStateSpace:
    """A system of `scipy.signal` and the names of its vectors.

    Attributes
    ----------
    system : scipy.signal.StateSpace
        SI. ``lsim`` works on the matrices; ``bode``, ``poles`` and ``zeros`` of SciPy go through
        polynomials, which lose all digits when SI values are far apart: python-control does not.
    states, inputs, outputs : tuple of str
        In the order of its matrices.
    """

    system: Any
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def to_scipy(program: Program) -> NamedStateSpace:
    """Return a linear `program` at its nominal parameters for `scipy.signal`.

    Raises
    ------
    UnusableInput
        It is not linear, or has memory; see `linear_model`.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, De, One, R, Se, Zero
    >>> from bondgraph.equations.codegen import program
    >>> with BondGraph("rc") as g:
    ...     loop, node = One("loop"), Zero("node")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> node >> C("C_1", 1e-6)
    ...     _ = node >> De("y")
    >>> found = to_scipy(program(g))
    >>> found.states, found.inputs, found.outputs
    (('q_C_1',), ('V',), ('y',))
    """
    from scipy import signal

    m = linear_model(program)
    return NamedStateSpace(signal.StateSpace(m.a, m.b, m.c, m.d), m.states, m.inputs, m.outputs)
