"""One take: a block of samples, and the waveform that is played meanwhile, in one loop."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, Chunk, Clock, Flag, WaveOut
from hardware.errors import HardwareError, TimedOut

_POLL: Final = 0.02
FLAGS: Final = "flags"


@dataclass(frozen=True, slots=True, eq=False)
class BlockPlan:
    """What a block shall be.

    Parameters
    ----------
    samples : int
        Length of the block.
    rate : float
        Of the samples (Hz).
    volts : ndarray, optional
        Waveform (V, (n,)) to be played meanwhile.
    wave_rate : float, optional
        Of the waveform (Hz); needed with it.
    """

    samples: int = 32768
    rate: float = 3125.0
    volts: NDArray[np.float64] | None = None
    wave_rate: float | None = None

    def __post_init__(self) -> None:
        """Check."""
        if self.samples < 1 or not 0.0 < self.rate < float("inf"):
            raise UnusableInput(
                f"block: {self.samples} samples at {self.rate} Hz; give more than 0"
            )
        if (self.volts is None) != (self.wave_rate is None):
            raise UnusableInput("block: a waveform and its rate need each other; give both")


@dataclass(slots=True)
class PartialTake:
    """What has arrived so far: chunks of the sensor and of the output."""

    block: list[Chunk] = field(default_factory=list)
    output: list[Chunk] = field(default_factory=list)


def take_block(
    acquisition: Acquisition,
    wave: WaveOut | None,
    plan: BlockPlan,
    clock: Clock,
    taken: PartialTake,
    ended: threading.Event,
    patience: float,
) -> None:
    """Play and poll until all is there; the acquisition is armed already.

    Parameters
    ----------
    acquisition : Acquisition
    wave : WaveOut or None
        Prepared, if the plan has a waveform.
    plan : BlockPlan
    clock : Clock
        Time of the program.
    taken : PartialTake
        Grows.
    ended : threading.Event
        Set by whoever wants it to end.
    patience : float
        Time (s) on top of the duration after which a missing sample is a fault.

    Raises
    ------
    HardwareError
        Of a device, with what had arrived in `taken`; everything is aborted then.
    """
    due = clock.now() + plan.samples / plan.rate + patience
    if plan.volts is not None and plan.wave_rate is not None:
        due += plan.volts.size / plan.wave_rate
    try:
        if wave is not None:
            _play(wave, acquisition, taken, ended)
        while not acquisition.done:
            arrived = acquisition.poll()
            taken.block.extend(arrived)
            if ended.is_set():
                raise HardwareError("block: ended before all samples had arrived")
            if clock.now() > due:
                raise TimedOut(
                    f"block: {sum(c.n for c in taken.block)} of {plan.samples} samples "
                    f"{patience:g} s after they were due; see the trigger and its cable"
                )
            if not arrived and not acquisition.done:
                clock.sleep(_POLL)
        taken.block.extend(acquisition.finish())
    except HardwareError as error:
        if isinstance(error.partial, Sequence):
            taken.block.extend(c for c in error.partial if isinstance(c, Chunk))
        acquisition.abort()
        raise
    except BaseException:
        acquisition.abort()
        raise


def _play(
    wave: WaveOut, acquisition: Acquisition, taken: PartialTake, ended: threading.Event
) -> None:
    playing = wave.play()
    try:
        for written in playing:
            taken.output.extend(written.chunks)
            if not acquisition.done:
                taken.block.extend(acquisition.poll())
            if ended.is_set():
                raise HardwareError("block: ended while the waveform was playing")
    finally:
        # a guarded waveform that is left early ramps down here
        close = getattr(playing, "close", None)
        if close is not None:
            close()


def block_arrays(
    chunks: Iterable[Chunk], samples: int, units: Mapping[str, str]
) -> dict[str, NDArray[np.float64] | NDArray[np.uint16]]:
    """Join chunks to arrays of a fixed length.

    Parameters
    ----------
    chunks : iterable of Chunk
        Of one stream.
    samples : int
        Length wanted.
    units : mapping
        Channels wanted.

    Returns
    -------
    dict
        Channels ``(samples,)`` and ``"flags"`` uint16. What never came is NaN with
        `Flag.LOST_BEFORE`; so is the flag of the sample behind a gap.
    """
    columns = {k: np.full(samples, np.nan) for k in units}
    flags = np.full(samples, int(Flag.LOST_BEFORE), np.uint16)
    following = 0
    for chunk in chunks:
        start, stop = chunk.first, min(chunk.first + chunk.n, samples)
        if start >= stop:
            continue
        for k, column in columns.items():
            if k in chunk.channels:
                column[start:stop] = chunk.channels[k][: stop - start]
        flags[start:stop] = chunk.flags[: stop - start]
        if start > following:
            flags[start] |= int(Flag.LOST_BEFORE)
        following = stop
    return {**columns, FLAGS: flags}
