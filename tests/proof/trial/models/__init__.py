"""What the tool is told of each plant of the sealed trial: one bond graph a plant.

Written from the description of the plants, not from the generator: names, signs and sensors are the
only things that both sides share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import MappingProxyType

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Source
from bondgraph.graph.parameter import Parameter
from bondgraph.support.errors import unknown_name
from tests.proof.trial.models.chain import chain
from tests.proof.trial.models.corner import corner
from tests.proof.trial.models.cylinder import cylinder
from tests.proof.trial.models.frame import frame
from tests.proof.trial.models.motor import motor
from tests.proof.trial.models.oven import oven
from tests.proof.trial.models.press import press
from tests.proof.trial.models.probe import probe
from tests.proof.trial.models.servo import servo
from tests.proof.trial.models.speaker import speaker
from tests.proof.trial.models.stack import stack
from tests.proof.trial.models.table import table
from tests.proof.trial.models.tanks import tanks

Models = MappingProxyType[str, Callable[[Sequence[str] | None], BondGraph]]

MODELS: Models = MappingProxyType(
    {
        "chain": chain,
        "stack": stack,
        "motor": motor,
        "corner": corner,
        "tanks": tanks,
        "probe": probe,
    }
)
"""Factories by the name of the plant; each takes the sensors that were recorded."""

EXAM_MODELS: Models = MappingProxyType({"cylinder": cylinder, "servo": servo, "oven": oven})
"""Factories of the plants that came with the development exam."""

LATER_MODELS: Models = MappingProxyType(
    {"frame": frame, "press": press, "table": table, "speaker": speaker}
)
"""Factories of the plants that came with trial 2; the last two are drawn by sealed trials only."""


def blind_model(plant: str, sensors: Sequence[str] | None = None, delay: float = 0.0) -> BondGraph:
    """Return the model of a plant with some of its sensors.

    Parameters
    ----------
    plant : str
        Name in `MODELS`, `EXAM_MODELS` or `LATER_MODELS`.
    sensors : sequence of str, optional
        Sensors that were recorded; all of them if not given.
    delay : float
        Dead time of the command that is declared, s: it becomes a parameter ``delay_SOURCE``,
        fitted and not a finding; 0 declares none.

    Raises
    ------
    UnknownName
        If there is no such plant or sensor.
    """
    known = {**MODELS, **EXAM_MODELS, **LATER_MODELS}
    if plant not in known:
        raise unknown_name("plant", plant, "the sealed trial", known)
    graph = known[plant](sensors)
    if delay <= 0.0:
        return graph
    (source,) = graph.of_type(Source)
    late = Parameter(f"delay_{source.name}", delay, "s", positive=False, lower=0.0, scale=delay)
    return graph.with_parameters([late]).with_element(source.name, drive=Drive(delay=late.name))
