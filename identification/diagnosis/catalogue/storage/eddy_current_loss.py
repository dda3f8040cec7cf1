"""A coil whose field drives currents elsewhere: a part of its inductance lies beside a resistor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bondgraph.graph.elements import Element, I, One, R, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.catalogue.places import coils
from identification.diagnosis.catalogue.storage.added_mode import inertia
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

FASTEST, SLOWEST, TRIED = 0.5, 0.1, 6
"""Time constants tried: of samples, of the duration, and how many."""


class EddyCurrentLoss(Effect):
    """An inductance with a resistor across it, in series with the coil's own."""

    name = "eddy_current_loss"
    family = "storage"
    kind = "slow"
    law = "shunted_inductance"
    sentence = "a part of its field drives currents in iron, a former or a shorted turn"
    looks = (
        "the faster the current changes the smaller is the inductance and the larger the "
        "resistance; slow currents see a constant coil"
    )
    confused_with = ("low_pass", "delay", "sensor_lag", "nonlinear_stiffness")
    separated_by = (
        "voltage and current with the armature blocked, from slow to fast: the resistance grows "
        "with the frequency, in the same way at every amplitude"
    )
    source = "Vanderkooy 1989; the LR-2 model of a voice coil (one branch)"
    meanings: ClassVar[Mapping[str, str]] = {
        "eddy": "inductance that the currents shunt, over the one that stays",
        "tau_eddy": "shunted inductance over the resistance across it",
    }
    where = staticmethod(coils)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Voltage of a shunted inductance as large as the coil's own, for several times."""
        past = scene.of(element)
        own = inertia(past)
        return tuple(
            Signature.of((own * shunted(past.argument, tau, past.dt),), tau=tau)
            for tau in map(float, _time_constants(past))
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a 0-junction with an inductance and a resistor into the loop of the coil."""
        past, g, name = scene.of(element), scene.graph, element.name
        tau, weight = float(_time_constants(past)[1]), 0.3
        if hint is not None:
            tau, weight = float(hint.shape["tau"]), float(np.clip(hint.weights[0], 0.02, 3.0))
        loop = g[g.neighbour(name)]
        if not isinstance(loop, One):
            (bond,) = g.bonds_of(name)
            loop = One(f"loop_{name}")
            g = g.with_inserted(bond, loop)
        amount = Parameter(f"eddy_{name}", 0.1, "1", lower=1e-5, upper=100.0, scale=0.1)
        time = Parameter(
            f"tau_eddy_{name}", tau, "s", lower=0.01 * past.dt, upper=past.duration, scale=tau
        )
        g = g.with_parameters([amount, time])
        a, t = (symbol(p.name, positive=True) for p in (amount, time))
        inductance, node = a * scene.graph.coefficient(element), Zero(f"field_{name}")
        g = g.with_branch(loop.name, [node])
        g = g.with_branch(node.name, [I(f"I_eddy_{name}", inductance, unit="H")])
        g = g.with_branch(node.name, [R(f"R_eddy_{name}", inductance / t, unit="ohm")])
        starts = ({amount.name: weight, time.name: tau}, {amount.name: 0.3, time.name: tau})
        return self.inserted(element, g, starts, (amount.name,))


def shunted(current: Array, tau: float, dt: float) -> Array:
    """Voltage of an inductance of 1 H with a resistor across it, of the time constant `tau`.

    ``s / (1 + tau s) i``.
    """
    return np.asarray((current - lagged(current, tau, dt)) / tau)


def _time_constants(past: PortHistory) -> Array:
    return np.geomspace(FASTEST * past.dt, SLOWEST * past.duration, TRIED)
