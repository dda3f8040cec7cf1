"""The pure hysteresis models of a piezo stack: voltage to displacement and nothing else.

``x = H[V_in]`` with Al Janaideh's or Ang's operator (thesis eq. 6.2 and 6.3). The operator, in
units of its own slope after a reversal, is the law of the drive: an effective voltage. One gain
makes it a displacement; the bonds carry signals, the model claims no power.
"""

from __future__ import annotations

from actuators.stack.scaling import scaled
from bondgraph import TF, BondGraph, De, GraphError, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.hysteresis import AlJanaideh, Ang, PrandtlIshlinskii
from bondgraph.laws import Hysteretic

SOURCE = "P-840.1, thesis table 6.1: T/k = 3.52 N/V / 65 N/um"


def stack_hysteresis(
    operator: PrandtlIshlinskii | AlJanaideh | Ang | None = None, *, gain: float | None = None
) -> BondGraph:
    """Piezo stack as an operator from voltage to displacement.

    Parameters
    ----------
    operator : PrandtlIshlinskii, AlJanaideh or Ang, optional
        ``H``, V to m; left out: the linear model ``x = g V_in``.
    gain : float, optional
        ``g``, m/V; by default the slope of the operator after a reversal, so that the model is
        exactly ``x = H[V_in]``, or without an operator T/k.

    Returns
    -------
    BondGraph
        No states besides the memory; input ``V_in``, reading ``x``.

    Raises
    ------
    GraphError
        If the slope of the operator after a reversal is not positive: there is nothing to scale by.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> operator = PrandtlIshlinskii((0.0, 10.0), (1.5e-7, 0.5e-7))  # m over V
    >>> slow = np.linspace(0.0, 1.0, 201)
    >>> volts = 50 - 50 * np.cos(2 * np.pi * slow)
    >>> loop = simulate(stack_hysteresis(operator), slow, {"V_in": volts})
    >>> round(float(loop["x"].max() * 1e6), 3)  # um
    19.5
    """
    slope = 3.52 / 65e6 if operator is None else float(operator.linear_slope)
    if not slope > 0.0:
        raise GraphError(
            f"stack_hysteresis: the operator's slope after a reversal is {slope:.3g} m/V; the law "
            "of the drive is scaled by it, so give weights[0] > 0"
        )
    law = None if operator is None else Hysteretic(scaled(operator, 1.0, 1.0 / slope))
    with BondGraph("stack_hysteresis") as g:
        rate = g.parameter("g", slope if gain is None else gain, "m/V", spread=3.0, source=SOURCE)
        tip = Zero("tip")
        (
            Se("V_in", unit="V", drive=Drive(law=law) if law else None)
            >> TF("G", ratio=1 / rate)
            >> tip
        )
        tip >> De("x", unit="m")
    return g


def stack_al_janaideh() -> BondGraph:
    """Return the pure model with Al Janaideh's operator, set (6.2).

    Examples
    --------
    >>> slow = np.linspace(0.0, 1.0, 201)
    >>> loop = simulate(stack_al_janaideh(), slow, {"V_in": 50 - 50 * np.cos(2 * np.pi * slow)})
    >>> round(float(loop["x"].max() * 1e6), 3)  # um
    4.915
    """
    return stack_hysteresis(AlJanaideh.stack_2hz())


def stack_ang() -> BondGraph:
    """Return the pure model with Ang's operator, set (6.3).

    Examples
    --------
    >>> slow = np.linspace(0.0, 1.0, 201)
    >>> loop = simulate(stack_ang(), slow, {"V_in": 50 - 50 * np.cos(2 * np.pi * slow)})
    >>> round(float(loop["x"].max() * 1e6), 3)  # um
    4.873
    """
    return stack_hysteresis(Ang.stack_2hz())
