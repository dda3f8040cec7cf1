"""A mode made ready to run: by the exact step where it has one, else by the general one."""

from __future__ import annotations

from collections.abc import Mapping

from bondgraph.simulation.modes.exact_mode import ExactMode
from bondgraph.simulation.modes.general_mode import GeneralMode
from bondgraph.simulation.modes.inputs import Inputs
from bondgraph.simulation.modes.mode_run import ModeRun
from bondgraph.simulation.modes.states import Mode


def opened(mode: Mode, inputs: Inputs, parameters: Mapping[str, float], accuracy: float) -> ModeRun:
    """Return `mode` at parameters, over the `inputs` of the record.

    Raises
    ------
    BondsightError
        Commands or parameters that it does not have; nothing determines one of its signals.
    """
    if mode.exact is not None:
        return ExactMode(mode, mode.exact, inputs, parameters, accuracy)
    return GeneralMode(mode, inputs, parameters, accuracy)
