"""What has to change in the printed sets to meet the stand-in of the measured loop.

The measured samples are not public; set (6.2) reproduces the described loop and stands in for them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuators.stack.conversions import (
    Lumped,
    Polarised,
    Pure,
    pure_from_lumped,
    pure_from_polarisation,
)
from actuators.thesis.operators import polarisation_operator_printed
from actuators.thesis.steady import misfit, sine, triangle
from actuators.thesis.tables import TABLE_6_1, TABLE_6_2
from actuators.thesis.values import named
from bondgraph.hysteresis import AlJanaideh, Ang, MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import Hysteretic
from bondgraph.support.arrays import FloatArray

SEARCHED = (3.0, 4.5)
"""Range of T that is searched, around the printed 3.52."""


def stand_in() -> AlJanaideh:
    """Return the operator that stands in for the measured loop, set (6.2), V to m."""
    return AlJanaideh.stack_2hz()


def lumped_constants(transducer: float | None = None) -> Lumped:
    """Return table 6.1 with another T (N/V) if one is given."""
    t = named(TABLE_6_1, "T") if transducer is None else transducer
    return Lumped(named(TABLE_6_1, "C"), t, named(TABLE_6_1, "k"))


def lumped_operator(transducer: float | None = None) -> Pure:
    """Return tables 6.1 and 6.4 as one operator V to m: slow, no force.

    Parameters
    ----------
    transducer : float, optional
        T, N/V; by default the printed one.
    """
    law = Hysteretic(MaxwellResistiveCapacitor.stack_2hz())
    return pure_from_lumped(law, lumped_constants(transducer))


def bond_graph_operator(transducer: float | None = None) -> Pure:
    """Return table 6.2 and the inverse of sec 6.5 as one operator V to m: slow, no force.

    Parameters
    ----------
    transducer : float, optional
        T, m/C; by default the printed number. Here it scales the displacement and nothing else.
    """
    t = named(TABLE_6_2, "T") if transducer is None else transducer
    return pure_from_polarisation(
        polarisation_operator_printed(), Polarised(t, named(TABLE_6_2, "l"))
    )


def refit_lumped() -> float:
    """Return the T (N/V) of table 6.1 with the least rms misfit, on the triangle as the thesis."""
    return _best(lumped_operator, triangle())


def refit_bond_graph() -> float:
    """Return the T (m/C) of table 6.2 with the least rms misfit, on the sine as the thesis."""
    return _best(bond_graph_operator, sine())


def _best(operator: Callable[[float], Pure], u: FloatArray) -> float:
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda t: 1e9 * misfit(operator(t), stand_in(), u).rms,
        bounds=SEARCHED,
        method="bounded",
        options={"xatol": 1e-5},
    )
    return float(found.x)


def refit_ang() -> Ang:
    """Return (6.3) with all 13 backlash weights fitted on the sine; dead zone as printed.

    With the dead zone known the weights are linear: ``S^-1[z] = sum w_i play_i[V]``. The last two
    plays move in the first rise only, so their weights rest on the virgin curve.

    References
    ----------
    ang2007, kuhnen2003
    """
    printed, u = Ang.stack_2hz(), sine()
    bent, _ = printed.dead_zone.inverse().run(stand_in().run(u)[0])
    weights, *_ = np.linalg.lstsq(printed.play.regressors(u), bent, rcond=None)
    plays = PrandtlIshlinskii(printed.play.thresholds, tuple(weights.tolist()))
    return Ang(plays, printed.dead_zone)
