"""Where the rates of a study move at random, as `Study.process_noise` names it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.support.errors import UnusableInput, real_number, unknown_name

ProcessNoise = tuple[str, ...] | Mapping[str, float] | None
"""Places, or places with start values (SI); None: every state."""


@dataclass(frozen=True, slots=True)
class Diffusion:
    """White noise of unknown intensity that enters the rate of a state.

    Attributes
    ----------
    place : str
        As it was named: a state, an element with a state, or a source.
    index : int
        Position among the states, or among the inputs.
    at_source : bool
        The noise is added to a command and acts where the command acts.
    unit : str
        Of the intensity: the state's (or the command's, times seconds) by square root of time.
    """

    place: str
    index: int
    at_source: bool
    unit: str


def admit_process_noise(given: object) -> ProcessNoise:
    """Return the places as a study keeps them; refuse what is no sequence, no name, no intensity.

    Examples
    --------
    >>> admit_process_noise(["m", "F"])
    ('m', 'F')
    """
    if given is None:
        return None
    if isinstance(given, str):
        raise UnusableInput(f"process_noise = {given!r}: give a sequence, such as ({given!r},)")
    try:
        names: tuple[Any, ...] = tuple(given)  # type: ignore[arg-type]
    except TypeError:  # no sequence at all
        names = (None,)
    if any(not isinstance(n, str) for n in names):
        raise UnusableInput(
            f"process_noise = {given!r}: give names of states, elements or sources, such as "
            "('m',), or a mapping of them to intensities"
        )
    if len(set(names)) < len(names):
        raise UnusableInput("process_noise names a place twice; name each once")
    if not isinstance(given, Mapping):
        return names
    levels = {n: real_number(f"process noise at {n}", v) for n, v in given.items()}
    for n, level in levels.items():
        if not level > 0:
            raise UnusableInput(
                f"process noise at {n} = {level:g}: give a positive intensity to start from, SI by "
                "the square root of time, or leave the place out"
            )
    return levels


def diffusion_at(dynamics: Dynamics, graph: BondGraph, place: str) -> Diffusion:
    """Return the diffusion of a place of a model.

    Raises
    ------
    UnknownName, UnusableInput
        The place has no state and is no source, or the rate of that source acts: that of white
        noise has no size.
    """
    elements = [n.partition("_")[2] for n in dynamics.state_names]
    for i, names in enumerate(zip(dynamics.state_names, elements, strict=True)):
        if place in names:
            return Diffusion(
                place,
                i,
                False,
                f"{dynamics.names.units.get(dynamics.state_names[i]) or 'SI'}/s^0.5",
            )
    if place not in dynamics.input_names or place not in graph.elements:
        sources = [n for n in dynamics.input_names if n in graph.elements]
        known = [*dynamics.state_names, *elements, *sources]
        raise unknown_name("place for process noise", place, graph.name, known)
    if f"d_{place}" in dynamics.input_names:
        raise UnusableInput(
            f"process noise at {place}: {graph.name} needs the rate of {place}, and white noise "
            "has none; name a state"
        )
    unit = str(getattr(graph[place], "unit", "") or "1")
    return Diffusion(place, dynamics.input_names.index(place), True, f"{unit}*s^0.5")
