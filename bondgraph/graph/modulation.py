"""Signals of a graph as symbols, for modulated elements and for the laws of fields."""

from __future__ import annotations

import sympy as sp

from bondgraph.graph.parameter import symbol

TIME: sp.Symbol = symbol("time")
"""Time since the start, s."""


def effort(name: str) -> sp.Symbol:
    """Return the effort at a one-port, a 0-junction or a bond written ``tail>head``.

    Examples
    --------
    >>> effort("k"), effort("body>k")
    (e_k, e_body>k)
    """
    return symbol(f"e_{name}")


def flow(name: str) -> sp.Symbol:
    """Return the flow at a one-port, a 1-junction or a bond written ``tail>head``.

    Examples
    --------
    >>> flow("body")
    f_body
    """
    return symbol(f"f_{name}")


def displacement(name: str) -> sp.Symbol:
    """Return the displacement stored in a C (or one port of a field, such as ``name1``).

    Examples
    --------
    >>> displacement("k")
    q_k
    """
    return symbol(f"q_{name}")


def momentum(name: str) -> sp.Symbol:
    """Return the momentum stored in an I.

    Examples
    --------
    >>> momentum("m")
    p_m
    """
    return symbol(f"p_{name}")


def external(name: str) -> sp.Symbol:
    """Return a signal from outside the graph: it becomes an input of the model.

    Examples
    --------
    >>> external("temperature")
    in_temperature
    """
    return symbol(f"in_{name}")


def port_variables(letter: str, n: int) -> tuple[sp.Symbol, ...]:
    """Return the variables in which the law of a field with `n` ports is written.

    Examples
    --------
    >>> port_variables("q", 2)
    (q1, q2)
    """
    return tuple(symbol(f"{letter}{i}") for i in range(1, n + 1))
