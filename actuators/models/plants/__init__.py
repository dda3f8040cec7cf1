"""What the tool is told of each virtual plant of demo and sealed trial: one bond graph a plant.

Written from the description of the plants, not from their generator: names, signs and sensors are
the only things that both sides share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import MappingProxyType

from actuators.models.plants.chain import chain
from actuators.models.plants.corner import corner
from actuators.models.plants.cylinder import cylinder
from actuators.models.plants.frame import frame
from actuators.models.plants.motor import motor
from actuators.models.plants.oven import oven
from actuators.models.plants.press import press
from actuators.models.plants.probe import probe
from actuators.models.plants.servo import servo
from actuators.models.plants.speaker import speaker
from actuators.models.plants.stack import stack
from actuators.models.plants.table import table
from actuators.models.plants.tanks import tanks
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import UnusableInput, require_known

PLANT_MODELS: MappingProxyType[str, Callable[[], BondGraph]] = MappingProxyType(
    {
        "chain": chain,
        "stack": stack,
        "motor": motor,
        "corner": corner,
        "tanks": tanks,
        "probe": probe,
        "cylinder": cylinder,
        "servo": servo,
        "oven": oven,
        "frame": frame,
        "press": press,
        "table": table,
        "speaker": speaker,
    }
)
"""Factories by the name of the plant; all its sensors are there."""


def plant_model(plant: str, sensors: Sequence[str] | None = None, delay: float = 0.0) -> BondGraph:
    """Return the model of a plant with some of its sensors.

    Parameters
    ----------
    plant : str
        Name in `PLANT_MODELS`.
    sensors : sequence of str, optional
        Sensors that were recorded; all of them if not given.
    delay : float
        Dead time of the command that is declared, s: it becomes a parameter ``delay_SOURCE``,
        fitted and not a finding; 0 declares none.

    Raises
    ------
    UnknownName, UnusableInput
        If there is no such plant or sensor, or no sensor is named.
    """
    require_known("plant", "the virtual plants", PLANT_MODELS, plant)
    graph = PLANT_MODELS[plant]()
    known = [e.name for e in graph.of_type(Sensor)]
    recorded = known if sensors is None else sensors
    require_known("sensor", plant, known, *recorded)
    if not recorded:
        raise UnusableInput(f"{plant}: name at least one sensor of {', '.join(known)}")
    for name in known:
        if name not in recorded:
            graph = graph.remove(name)
    if delay <= 0.0:
        return graph
    (source,) = graph.of_type(Source)
    late = Parameter(f"delay_{source.name}", delay, "s", positive=False, lower=0.0, scale=delay)
    return graph.with_parameters([late]).with_element(source.name, drive=Drive(delay=late.name))
