"""A drive that follows with a lag."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import commands, lump_at
from identification.diagnosis.catalogue.signal_traces import LAGS, lateness, weight_of
from identification.diagnosis.screening.port_history import FittedModel


class LowPass(Effect):
    """The drive follows with a first-order lag."""

    name = "low_pass"
    family = "drive"
    kind = "command"
    law = "first_order_lag"
    sentence = "it follows the command with a first-order lag"
    looks = "late and smaller the faster the command, the same at every amplitude"
    confused_with = ("delay", "sensor_lag", "slew_limit", "linear_capacity")
    separated_by = (
        "a multisine up to well beyond the corner: a lag falls in gain, a delay does not; a second "
        "sensor tells the drive's lag from a sensor's"
    )
    from_one: ClassVar[Mapping[str, str]] = {
        "delay": "a multisine up to well beyond the corner: a lag falls in gain, a delay does not",
        "sensor_lag": "record what the drive really puts out beside its command, and diagnose with "
        "that as the input: a lag of the drive is gone then, that of a reading is not; or read the "
        "motion by a second sensor: a lag of the drive shows in both, that of a reading in one",
        "slew_limit": "the same fast command at half the amplitude: a rate limit vanishes, a lag "
        "stays",
    }
    source = "single-pole amplifier"
    meanings: ClassVar[Mapping[str, str]] = {
        "tau": "time constant of the lag",
    }
    where = staticmethod(commands)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """How far the command stays behind, for several time constants."""
        return lateness(scene, element)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """One lag, from a fraction of a sample to a part of the record."""
        tau = lag_parameter(scene, element)
        graph = scene.graph.with_parameters([tau]).with_element(
            element.name, drive=Drive(lag=tau.name)
        )
        made = self.inserted(element, graph, lag_starts(scene, tau, hint), (tau.name,))
        lump = lump_at(scene.graph, element)
        if not lump:
            return made
        says = f"a {lump} behind a resistance, which the model lacks there, does"
        if lump == "heat capacity":
            says = "a heater with heat of its own does"
        return replace(made, sentence=f"{self.sentence}, as {says}")


def lag_parameter(scene: FittedModel, element: Element) -> Parameter:
    """Time constant of a lag at `element`."""
    dt, n = scene.data.dt, scene.data.n
    return Parameter(f"tau_{element.name}", 2 * dt, "s", lower=0.02 * dt, upper=0.1 * n * dt)


def lag_starts(
    scene: FittedModel, tau: Parameter, hint: Hint | None
) -> tuple[dict[str, float], ...]:
    """Start values of a lag: what the signature says, or many."""
    if hint is None:
        return tuple({tau.name: k * scene.data.dt} for k in LAGS)
    shape = float(hint.shape["tau"])
    found = [shape * weight_of(hint), shape]
    kept = dict.fromkeys(float(min(max(v, tau.lower or v), tau.upper or v)) for v in found)
    return tuple({tau.name: v} for v in kept)
