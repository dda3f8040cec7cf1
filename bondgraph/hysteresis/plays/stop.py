"""The stop: an elastic link that slips when it is stretched beyond r."""

from __future__ import annotations

from bondgraph.hysteresis.plays.play import play
from bondgraph.support.ops import Expression, Ops


def stop(ops: Ops, x: Expression, r: Expression, y: Expression) -> Expression:
    """Return the stretch of a stop after the input went monotonically to ``x``.

    ``z = x - play(x, r, y)``, which equals the incremental ``z+ = clip(z + dx, -r, r)``. The
    memory is the anchor ``y = x - z`` (where the far end of the link sits), advanced by `play`.
    With the anchor instead of the stretch as memory no increment is summed up, so neither rounding
    nor the number of samples matters, and a held input while slipping keeps its output.

    The arguments are those of `play`: input, stretch at which it slips, and anchor.

    Returns
    -------
    expression
        Stretch in [-r, r], shape and unit of ``x``.

    References
    ----------
    krejci2001

    Examples
    --------
    >>> from bondgraph.support.ops import NUMPY
    >>> float(stop(NUMPY, 3.0, 1.0, 0.0))
    1.0
    """
    return x - play(ops, x, r, y)
