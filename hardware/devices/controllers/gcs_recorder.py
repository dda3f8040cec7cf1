"""The controller's own data recorder as an acquisition: position and voltage on its clock.

Record options 2 and 16 and the trigger option 4 are those of the E-712's public list; other models
number them differently (ask ``HDR?``).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Identity
from hardware.devices.controllers.gcs_controller import GcsController
from hardware.errors import HardwareError, Overrun, ProtocolFault

POINTS = 0x16000200
"""Parameter number of the points of all recorder tables together."""

_DEFAULT, _IMMEDIATE = 0, 4
_PIECE = 4096


@final
class GcsRecorder:
    """Two tables of the data recorder: ``x`` (m) of the axis, ``V_mon`` (V) of its output.

    Parameters
    ----------
    controller : GcsController
        The axis.
    points : int
        Samples to record.
    rate : float
        Samples per second (Hz): the servo rate by a whole number.
    trigger : {"wave", "now"}
        Start with the wave generator, or on `kickoff`.
    stream : str
        Name of the stream.
    options : tuple of int
        Record options of this model for position (um) of an axis and voltage (V) of a channel.
    """

    def __init__(
        self,
        controller: GcsController,
        points: int,
        rate: float,
        trigger: Literal["wave", "now"] = "wave",
        stream: str = "controller",
        options: tuple[int, int] = (2, 16),
    ) -> None:
        if trigger not in ("wave", "now"):
            raise UnusableInput(f"{stream}: trigger {trigger!r} is unknown; choose wave or now")
        if points < 1 or not rate > 0.0:
            raise UnusableInput(f"{stream}: points and rate must be positive")
        self._controller = controller
        self._points = points
        self.rate = rate
        self._trigger = trigger
        self.stream = stream
        self._options = options
        self._taken = 0

    @property
    def identity(self) -> Identity:
        """The controller."""
        return self._controller.identity

    @property
    def done(self) -> bool:
        """Whether all points have been handed out."""
        return self._taken >= self._points

    def kickoff(self) -> None:
        """Set the tables up; they fill from the trigger on, or at once.

        Raises
        ------
        Overrun
            If a table does not hold so many points; nothing is set up then.
        ProtocolFault
            If the controller has not the two tables.
        UnusableInput
            If the rate is not the servo rate by a whole number.
        """
        c, talk = self._controller, self._controller.talk
        tables = c.integer("TNR?")
        if tables < 2:
            raise ProtocolFault(
                f"{talk.address}: has {tables} recorder tables by TNR?, 2 are needed; check that "
                "this model has a data recorder, or record with another device",
                tables,
            )
        room = int(c.parameter("1", POINTS)) // tables
        if self._points > room:
            raise Overrun(
                f"{talk.address}: {self._points} points asked for, a recorder table holds {room}; "
                "record fewer, or slower"
            )
        divider = c.divider(self.rate, "record")
        self._taken = 0
        position, voltage = self._options
        talk.send(f"DRC 1 {c.setup.axis} {position} 2 {c.setup.channel} {voltage}")
        talk.send(f"RTR {divider}")
        talk.send(f"DRT 0 {_IMMEDIATE if self._trigger == 'now' else _DEFAULT} 0")

    def poll(self) -> Sequence[Chunk]:
        """Return what was recorded since the last call, at most some thousand points."""
        there = min(self._there(), self._points)
        count = min(there - self._taken, _PIECE)
        if count <= 0:
            return ()
        talk = self._controller.talk
        query = f"DRR? {self._taken + 1} {count} 1 2"
        values = gcs_array(talk.ask(query), talk.address)
        if values.shape != (count, 2):
            raise ProtocolFault(
                f"{talk.address}: {values.shape} values answered to {query!r}", values
            )
        chunk = Chunk(
            self.stream,
            self._taken,
            {"x": 1e-6 * values[:, 0], "V_mon": values[:, 1]},
            {"x": "m", "V_mon": "V"},
        )
        self._taken += count
        return (chunk,)

    def finish(self) -> Sequence[Chunk]:
        """Return the rest of what is recorded by now."""
        chunks: list[Chunk] = []
        try:
            while not self.done and (more := self.poll()):
                chunks.extend(more)
        except HardwareError as error:
            raise error.carrying(tuple(chunks)) from None
        return chunks

    def abort(self) -> None:
        """Trigger no more; what is recorded stays in the device. Never raises."""
        try:
            self._controller.talk.send(f"DRT 0 {_DEFAULT} 0")
        except HardwareError:
            pass

    def _there(self) -> int:
        answer = self._controller.talk.ask("DRL? 1 2")
        try:
            return min(int(line.rpartition("=")[2]) for line in answer.splitlines())
        except ValueError:
            raise ProtocolFault(
                f"{self._controller.talk.address}: {answer[:60]!r} is no answer to DRL?", answer
            ) from None


def gcs_array(text: str, address: str) -> NDArray[np.float64]:
    """Return the values of a GCS array, ``(n, columns)``.

    Parameters
    ----------
    text : str
        Header lines that start with ``#``, then one line a row.
    address : str
        From whom, for messages.

    Raises
    ------
    ProtocolFault
        If header and values do not fit.
    """
    header, ended, body = text.partition("END_HEADER")
    entries = dict(
        (key.strip(" #"), value.strip())
        for key, equals, value in (line.partition("=") for line in header.splitlines())
        if equals
    )
    try:
        columns, rows = int(entries["DIM"]), int(entries["NDATA"])
        values = np.array(body.split(), dtype=np.float64)
        if not ended:
            raise ValueError("no END_HEADER")
        return values.reshape(rows, columns)
    except (KeyError, ValueError) as error:
        raise ProtocolFault(
            f"{address}: not a whole GCS array ({error}); header {header[:80]!r}", text
        ) from None
