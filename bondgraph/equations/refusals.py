"""What stands in the way of equations, or of the exact step, by name."""

from __future__ import annotations

from bondgraph.support.errors import GraphError


class DerivativeCausality(GraphError):
    """A storage depends on the others and this graph's form of it is not solved.

    Examples
    --------
    >>> issubclass(DerivativeCausality, BondsightError)
    True
    """


class NotLinearUpToLaws(GraphError):
    """A graph with modulated elements or nonlinear fields: its `System.lure` is None.

    Examples
    --------
    >>> from bondgraph import flow
    >>> def fan():
    ...     with BondGraph("fan") as g:
    ...         shaft = One("shaft")
    ...         Se("M", unit="N*m") >> shaft >> I("J", 1e-3, unit="kg*m2")
    ...         MSe("drag", -1e-4 * flow("shaft") ** 2, unit="N*m") >> shaft
    ...         shaft >> Df("w", unit="rad/s")
    ...     return g
    >>> equations(fan()).rates, equations(fan()).lure
    ((M - 0.0001*p_J**2/J**2,), None)
    >>> from bondgraph.simulation.lure import compile_model
    >>> try:
    ...     compile_model(fan())
    ... except NotLinearUpToLaws as error:
    ...     print(error)
    fan: MSe drag multiplies or transforms signals, so the model is not linear up to ...
    """


class AlgebraicLoop(GraphError):
    """Signals depend on each other without a state between them.

    Examples
    --------
    >>> issubclass(AlgebraicLoop, BondsightError)
    True
    """
