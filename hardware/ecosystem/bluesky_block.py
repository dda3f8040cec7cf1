"""A block of samples as ONE Bluesky event with array fields; no import of Bluesky."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, Clock, WallClock, WaveOut
from hardware.ecosystem.block import BlockPlan, PartialTake, block_arrays, take_block
from hardware.ecosystem.documents import array_key, number_key, or_nan, readings, source_of
from hardware.ecosystem.status import ActionStatus

_OUTPUT_UNITS = {"V": "V"}


@final
class BlueskyBlock:
    """Preparable, Flyable, EventPageCollectable, Triggerable, Readable, Stageable, Stoppable.

    As a flyer it makes one event in the stream of its name (and one of the played waveform in
    ``<name>_output``), as a detector one per trigger. One loop plays and polls, so that both share
    the time of the program.

    Parameters
    ----------
    make : callable
        Returns an acquisition that is ready for ``kickoff``, given samples and rate (Hz).
    units : mapping of str to str
        Channels to be stored, and their units.
    wave : WaveOut, optional
        Guarded waveforms, for plans that play one; it must park by itself when left early.
    plan : BlockPlan, optional
        Until `prepare` says something else; by default `BlockPlan()`.
    name : str
        Prefix of the fields and name of the stream.
    clock : Clock, optional
        Time of the program.
    patience : float
        Time (s) on top of the duration after which a missing sample is a fault.
    flat : bool
        Describe the block's stream alone, for plans that declare it
        (``declare_stream(block, name=..., collect=True)``).
    """

    parent: None = None

    def __init__(
        self,
        make: Callable[[int, float], Acquisition],
        units: Mapping[str, str],
        *,
        wave: WaveOut | None = None,
        plan: BlockPlan | None = None,
        name: str = "block",
        clock: Clock | None = None,
        patience: float = 5.0,
        flat: bool = False,
    ) -> None:
        self._make = make
        self._units = dict(units)
        self._wave = wave
        self.plan = plan or BlockPlan()
        self.name = name
        self._clock: Clock = WallClock() if clock is None else clock
        self._patience = patience
        self._flat = flat
        self._source = "not yet opened"
        self.taken = PartialTake()
        self._ended = threading.Event()
        self._run: ActionStatus | None = None
        self._collected = True
        self._stamp = 0.0

    def prepare(self, value: BlockPlan) -> ActionStatus:
        """Check the next block; its waveform is judged by the envelope and loaded here."""
        self._require_idle("prepare")
        if value.volts is not None and value.wave_rate is not None:
            if self._wave is None:
                raise UnusableInput(f"{self.name}: a waveform, but no output for it; give wave=")
            self._wave.prepare(value.volts, value.wave_rate)
        self.plan = value
        return ActionStatus.finished(f"prepare {self.name}")

    def kickoff(self) -> ActionStatus:
        """Arm, and start the waveform if there is one."""
        self._require_idle("kickoff")
        acquisition = self._make(self.plan.samples, self.plan.rate)
        self._source = source_of(acquisition.identity)
        self.taken, self._collected = PartialTake(), False
        self._ended = threading.Event()
        wave = None if self.plan.volts is None else self._wave
        acquisition.kickoff()
        plan, taken, ended = self.plan, self.taken, self._ended
        self._stamp = time.time()
        self._run = ActionStatus.run(
            f"take {self.name}",
            lambda: take_block(acquisition, wave, plan, self._clock, taken, ended, self._patience),
        )
        return ActionStatus.finished(f"arm {self.name}")

    def complete(self) -> ActionStatus:
        """Return the status of the running block."""
        return ActionStatus.finished(f"take {self.name}") if self._run is None else self._run

    def trigger(self) -> ActionStatus:
        """Take a whole block, as a detector."""
        self.kickoff()
        return self.complete()

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the last block as arrays."""
        self._require_idle("read")
        self._collected = True
        return readings(self._block(), self._stamp)

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return shapes, units and source of the block's fields."""
        n = self.plan.samples
        keys = {
            f"{self.name}_{k}": array_key(self._source, u, n, np.dtype(np.float64))
            for k, u in self._units.items()
        }
        keys[f"{self.name}_flags"] = array_key(self._source, "", n, np.dtype(np.uint16))
        return keys

    def describe_collect(self) -> dict[str, Any]:
        """Return `describe` by stream, or that of the block alone if `flat`."""
        if self._flat:
            return self.describe()
        streams = {self.name: self.describe()}
        if self.plan.volts is not None:
            n = self.plan.volts.size
            streams[f"{self.name}_output"] = {
                f"{self.name}_output_V": array_key("output", "V", n, np.dtype(np.float64)),
                f"{self.name}_output_flags": array_key("output", "", n, np.dtype(np.uint16)),
            }
        return streams

    def collect_pages(self) -> Iterator[dict[str, Any]]:
        """Yield every stream's one event; nothing if it was collected already."""
        if self._collected:
            return
        self._require_idle("collect")
        self._collected = True
        yield self._page(self._block())
        if self.plan.volts is not None and not self._flat:
            arrays = block_arrays(self.taken.output, self.plan.volts.size, _OUTPUT_UNITS)
            yield self._page({f"{self.name}_output_{k}": v for k, v in arrays.items()})

    def read_configuration(self) -> dict[str, dict[str, Any]]:
        """Return rate, length and waveform rate."""
        return readings(
            {
                f"{self.name}_rate": self.plan.rate,
                f"{self.name}_samples": self.plan.samples,
                f"{self.name}_wave_rate": or_nan(self.plan.wave_rate),
            }
        )

    def describe_configuration(self) -> dict[str, dict[str, Any]]:
        """Return the keys of `read_configuration`."""
        return {
            f"{self.name}_rate": number_key(self._source, "Hz"),
            f"{self.name}_samples": {"source": self._source, "dtype": "integer", "shape": []},
            f"{self.name}_wave_rate": number_key(self._source, "Hz"),
        }

    def stage(self) -> ActionStatus:
        """End what an earlier run may have left."""
        self.stop()
        self._collected = True
        return ActionStatus.finished(f"stage {self.name}")

    def unstage(self) -> ActionStatus:
        """End what is running."""
        self.stop()
        return ActionStatus.finished(f"unstage {self.name}")

    def stop(self, success: bool = True) -> None:
        """End a running block; its waveform is left early and ramps down."""
        self._ended.set()
        if self._run is not None and not self._run.done:
            self._run.exception(2.0 * self._patience + 1.0)

    def pause(self) -> None:
        """End a running block: it cannot wait."""
        self.stop()

    def resume(self) -> None:
        """Do nothing: the plan takes a new block."""

    def _block(self) -> dict[str, NDArray[Any]]:
        arrays = block_arrays(self.taken.block, self.plan.samples, self._units)
        return {f"{self.name}_{k}": v for k, v in arrays.items()}

    def _page(self, arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        return {
            "data": {k: [v] for k, v in arrays.items()},
            "timestamps": {k: [self._stamp] for k in arrays},
            "time": [self._stamp],
        }

    def _require_idle(self, what: str) -> None:
        if self._run is not None and not self._run.done:
            raise UnusableInput(f"{self.name}: {what} while a block is being taken; wait or stop")
