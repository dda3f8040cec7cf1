"""A double of the part of nidaqmx 1.7 that is used, on a virtual clock; it records every call.

It is no proof that the adapter runs on NI's driver: only that it calls what the package offers, in
the order that its documentation asks for.
"""

from __future__ import annotations

import sys
import types
from enum import Enum
from typing import Any

import numpy as np
import pytest


class Edge(Enum):
    RISING = 10280


class AcquisitionType(Enum):
    FINITE = 10178


class Signal(Enum):
    SAMPLE_CLOCK = 12487
    START_TRIGGER = 12491


class DaqError(Exception):
    def __init__(self, message: str, error_code: int, task_name: str = "") -> None:
        super().__init__(message)
        self.error_code = error_code


class DaqNotFoundError(Exception):
    pass


class DaqNotSupportedError(Exception):
    pass


class Bench:
    """What the double shares: time, calls, what is on the outputs, faults."""

    def __init__(self) -> None:
        self.time = 0.0
        self.calls: list[tuple[Any, ...]] = []
        self.outputs: dict[str, float] = {}
        self.open: dict[str, Any] = {}
        self.fail: dict[str, Exception] = {}
        self.triggered = True
        self.tasks: list[Any] = []
        self.stopping = 0.0
        """Time that a card needs to stop (s)."""
        self.forgets = False
        """Whether the driver tells 0 samples once a task has stopped."""

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds

    def note(self, *call: Any) -> None:
        self.calls.append(call)
        if call[0] in self.fail:
            raise self.fail[call[0]]

    def names(self) -> list[str]:
        return [c[0] for c in self.calls]


def make(bench: Bench) -> types.ModuleType:
    """The module."""

    class Task:
        def __init__(self, new_task_name: str = "") -> None:
            bench.note("Task")
            self.kind, self.channels = "", []  # type: ignore[var-annotated]
            self.rate, self.count, self.source = 0.0, 0, ""
            self.data = np.zeros(0)
            self.started: float | None = None
            self.kept = 0
            self.taken = 0
            self.closed = False
            self.ao_channels = self.ai_channels = self.timing = self
            self.triggers = self.start_trigger = self.export_signals = self
            self.in_stream = self.out_stream = self
            bench.tasks.append(self)

        def add_ao_voltage_chan(
            self, physical_channel: str, *, min_val: float = -10.0, max_val: float = 10.0
        ) -> None:
            bench.note("add_ao", physical_channel, min_val, max_val)
            if physical_channel in bench.open:
                raise DaqError("the specified resource is reserved", -50103)
            bench.open[physical_channel] = self
            self.kind, self.channels = "ao", [physical_channel]

        def add_ai_voltage_chan(
            self, physical_channel: str, *, min_val: float = -5.0, max_val: float = 5.0
        ) -> None:
            bench.note("add_ai", physical_channel, min_val, max_val)
            self.kind = "ai"
            self.channels.append(physical_channel)

        def cfg_samp_clk_timing(
            self,
            rate: float,
            source: str = "",
            active_edge: Edge = Edge.RISING,
            sample_mode: AcquisitionType = AcquisitionType.FINITE,
            samps_per_chan: int = 1000,
        ) -> None:
            bench.note("timing", self.kind, rate, source, samps_per_chan)
            self.rate, self.source, self.count = rate, source, samps_per_chan

        def cfg_dig_edge_start_trig(
            self, trigger_source: str, trigger_edge: Edge = Edge.RISING
        ) -> None:
            bench.note("trigger", trigger_source)

        def export_signal(self, signal_id: Signal, output_terminal: str) -> None:
            bench.note("export", signal_id, output_terminal)

        def write(self, data: Any, auto_start: bool = False, timeout: float = 10.0) -> int:
            bench.note("write", auto_start)
            values = np.atleast_1d(np.asarray(data, float))
            assert np.isfinite(values).all()
            if auto_start:
                bench.outputs[self.channels[0]] = float(values[-1])
            self.data = values
            return values.size

        def start(self) -> None:
            bench.note("start", self.kind)
            self.started = bench.time

        def _clocked(self) -> int:
            """Edges of the sample clock since the start; that of the output if it is used."""
            if self.started is None:
                return 0 if bench.forgets else self.kept
            if not bench.triggered:
                return 0
            start, own = self.started, self
            if self.source.endswith("/ao/SampleClock"):
                running = [t for t in bench.tasks if t.kind == "ao" and t.started is not None]
                if not running:
                    return 0
                own, start = running[-1], running[-1].started
                assert self.started <= start, "inputs armed after the clock has started"
            # the first edge comes with the start
            return min(int((bench.time - start) * own.rate + 1e-9) + 1, self.count)

        @property
        def total_samp_per_chan_generated(self) -> int:
            bench.note("generated")
            done = self._clocked()
            if done:
                bench.outputs[self.channels[0]] = float(self.data[done - 1])
            return done

        def is_task_done(self) -> bool:
            return self._clocked() >= self.count

        @property
        def avail_samp_per_chan(self) -> int:
            bench.note("available")
            return self._clocked() - self.taken

        def stop(self) -> None:
            bench.note("stop", self.kind)
            if self.started is not None and self.kind == "ao":
                bench.time += bench.stopping
                self.kept = self.total_samp_per_chan_generated
            self.started = None

        def close(self) -> None:
            bench.note("close", self.kind)
            self.closed = True
            for name in [n for n, t in bench.open.items() if t is self]:
                del bench.open[name]

    class AnalogMultiChannelReader:
        def __init__(self, task_in_stream: Task) -> None:
            self.task = task_in_stream

        def read_many_sample(
            self, data: np.ndarray, number_of_samples_per_channel: int = -1, timeout: float = 10.0
        ) -> int:
            task = self.task
            assert data.shape == (len(task.channels), number_of_samples_per_channel)
            assert number_of_samples_per_channel <= task._clocked() - task.taken
            output = [t for t in bench.tasks if t.kind == "ao" and t.count]
            source = output[-1].data if output else np.arange(task.count, dtype=float)
            k = task.taken + np.arange(number_of_samples_per_channel)
            before = np.concatenate([[0.0], source])[k]
            for row in range(len(task.channels)):
                data[row] = before * (row + 1)
            task.taken += number_of_samples_per_channel
            return number_of_samples_per_channel

    class Device:
        def __init__(self, name: str) -> None:
            bench.note("device", name)
            self.product_type, self.serial_num = "PCIe-6363", 0x1A2B3C

    module = types.ModuleType("nidaqmx")
    parts: dict[str, dict[str, Any]] = {
        "constants": {"Edge": Edge, "AcquisitionType": AcquisitionType, "Signal": Signal},
        "errors": {
            "DaqError": DaqError,
            "DaqNotFoundError": DaqNotFoundError,
            "DaqNotSupportedError": DaqNotSupportedError,
        },
        "stream_readers": {"AnalogMultiChannelReader": AnalogMultiChannelReader},
        "system": {"Device": Device},
    }
    for name, content in parts.items():
        part = types.ModuleType(f"nidaqmx.{name}")
        part.__dict__.update(content)
        setattr(module, name, part)
    module.Task = Task  # type: ignore[attr-defined]
    return module


def install(patch: pytest.MonkeyPatch) -> Bench:
    """Put the double in the place of the package."""
    bench = Bench()
    module = make(bench)
    patch.setitem(sys.modules, "nidaqmx", module)
    for name in ("constants", "errors", "stream_readers", "system"):
        patch.setitem(sys.modules, f"nidaqmx.{name}", getattr(module, name))
    return bench
