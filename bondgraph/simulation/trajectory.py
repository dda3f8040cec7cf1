"""What a simulation returns: outputs over time, and where a later run goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from bondgraph.drawing.courses import courses
from bondgraph.drawing.panels import Panels
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.files.checks import optional
from bondgraph.signals.units import read_unit
from bondgraph.simulation.modes.guards import SwitchEvent
from bondgraph.support.arrays import Array
from bondgraph.support.errors import require_known


@dataclass(frozen=True)
class Trajectory:
    """Simulated outputs over time.

    Attributes
    ----------
    time : ndarray, shape (N,), s
    outputs : dict of str to ndarray, shape (N,), SI
        Sensor readings, then observed signals.
    laws : dict of str to tuple of ndarray
        For each nonlinear law its argument and its deviation, shape (N,) each.
    steps_per_sample : int
        Sub-steps that met the accuracy asked for; on the average where they were halved only where
        a law switches or bends.
    state : ndarray, shape (n_x,)
        State at the last sample; with `memory` a later run goes on from here.
    memory : dict of str to tuple of float
        Memory of each law that has one, at the last sample, by element.
    states : tuple of str
        Names of the states, in the order of `state`.
    settled : bool
        Whether the last doubling of the sub-steps changed the outputs by less than the accuracy
        asked for; not where an output only rests, or jumps between samples.
    inner_steps : int
        Steps that CVODES or IDAS took in all runs, 0 without them.
    hold : {"hold", "linear", "band-limited"}
        What the inputs did between samples.
    units : dict of str to str
        SI units of the outputs, where the sensors name them.
    events : tuple of SwitchEvent
        Which guards have switched a junction, and when; see `simulate_modes`.

    Examples
    --------
    >>> list(simulate(graph, t, {"F": force}).to_pandas())
    ['x']
    """

    name: str
    time: Array
    outputs: dict[str, Array]
    laws: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    steps_per_sample: int = 1
    state: Array = field(default_factory=lambda: np.zeros(0))
    memory: dict[str, tuple[float, ...]] = field(default_factory=dict)
    states: tuple[str, ...] = ()
    settled: bool = True
    inner_steps: int = 0
    hold: str = "linear"
    units: Mapping[str, str] = field(default_factory=dict)
    events: tuple[SwitchEvent, ...] = ()

    def __getitem__(self, name: str) -> Array:
        """Output by name."""
        require_known("output", self.name, self.outputs, name)
        return self.outputs[name]

    def __repr__(self) -> str:
        """Short text."""
        unsettled = "" if self.settled else ", not settled"
        outputs = ", ".join(self.outputs)
        count = len(self.events)
        events = f", {count} event{'s' if count > 1 else ''}" if count else ""
        return f"Trajectory({self.name!r}, {self.time.size} samples, {outputs}{events}{unsettled})"

    def to_pandas(self) -> Any:
        """Return a data frame with time as index (needs pandas)."""
        pandas = optional("pandas", "to_pandas", "tables")
        return pandas.DataFrame(self.outputs, index=pandas.Index(self.time, name="t"))

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over `time` with units as attributes, as recordings do."""
        xarray = optional("xarray", "to_xarray", "tables")
        data = {
            n: ("time", np.array(v), {"units": self.units[n]} if n in self.units else {})
            for n, v in self.outputs.items()
        }
        time = {"time": ("time", np.array(self.time), {"units": "s"})}
        return xarray.Dataset(data, coords=time, attrs={"name": self.name})

    def plot(self) -> Panels:
        """Draw the outputs over time; returns matplotlib axes, one an output."""
        return courses(self.time, self.outputs, self.units)

    def _repr_html_(self) -> str:
        """Return a table of the outputs for notebooks."""
        rows = "".join(
            f"<tr><td>{escape(n)}</td><td>{v.min():.4g}</td><td>{v.max():.4g}</td>"
            f"<td>{v[-1]:.4g}</td></tr>"
            for n, v in self.outputs.items()
        )
        head = "<tr><th>output</th><th>least</th><th>most</th><th>last</th></tr>"
        return f"<p>{escape(repr(self))}</p><table>{head}{rows}</table>"


def units_of(graph: BondGraph) -> dict[str, str]:
    """Return the SI units of the readings, where they are named."""
    found = {s.name: read_unit(s.unit) for s in graph.of_type(Sensor) if s.unit}
    return {n: u.si for n, u in found.items() if u is not None and u.si != "1"}
