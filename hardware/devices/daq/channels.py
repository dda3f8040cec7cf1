"""Single outputs and groups of inputs of a Humusoft card."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Identity
from hardware.devices.daq.card import Card
from hardware.devices.daq.codes import HIGHEST, LOWEST, STEP


@final
class CardChannel:
    """One output of a card, in volts at its terminal.

    Parameters
    ----------
    card : Card
        The card; closing the channel closes it.
    channel : int
        Number of the output.
    """

    def __init__(self, card: Card, channel: int = 0) -> None:
        self.card = card
        self.channel = channel

    @property
    def identity(self) -> Identity:
        """The card."""
        return self.card.identity

    @property
    def lowest(self) -> float:
        """Lowest voltage (V)."""
        return LOWEST

    @property
    def highest(self) -> float:
        """Highest voltage (V)."""
        return HIGHEST

    @property
    def resolution(self) -> float:
        """Smallest step (V)."""
        return STEP

    def adopt(self) -> bool:
        """Take over outputs that an earlier program left on."""
        return self.card.adopt()

    def power_up(self) -> None:
        """Bring the card to 0 V."""
        self.card.power_up()

    def write(self, volts: float) -> float:
        """Set (V); return what the converter makes of it (V)."""
        return self.card.write(self.channel, volts)

    def close(self) -> None:
        """Let go of the card."""
        self.card.close()


@final
class CardInputs:
    """Some inputs of a card, sampled together.

    Parameters
    ----------
    card : Card
        The card.
    channels : sequence of int
        Numbers of the inputs.
    """

    def __init__(self, card: Card, channels: Sequence[int]) -> None:
        self.card = card
        self.channels = tuple(channels)

    def read(self) -> NDArray[np.float64]:
        """Voltages (V), ``(n,)``."""
        return self.card.convert(self.channels)
