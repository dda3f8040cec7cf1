"""Where the numbers of a recording come from, as it is stored with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.support.archive import software
from bondgraph.support.errors import UnusableInput
from bondgraph.support.json_codec import to_plain
from hardware.contracts import Air, Identity
from hardware.storage.flag_runs import FlagRun, expanded, flag_runs
from hardware.storage.plain_fields import fields_of, made_from

KEY = "acquisition"
SCHEMA = "bondsight-acquisition/1"
OUTPUT_ENDS = ("parked", "driven", "unknown", "none")
"""State of the output at the end: at its safe value, left at its last, unknown, no output."""
_FILTER_REACH = 20  # new samples; half the length of the filter of `Recording.decimate`


@dataclass(frozen=True, slots=True)
class StreamOrigin:
    """Who measured a stream, and how fast.

    Parameters
    ----------
    stream : str
        Its name.
    device : Identity
        The device.
    nominal_rate : float
        Hz, on the device's own clock.
    measured_rate : float, optional
        Hz, on the recording's time base.
    rate_uncertainty : float, optional
        Standard uncertainty of the measured rate (Hz).
    samples : int
        Samples that arrived.
    lost : int
        Samples known to be missing.
    """

    stream: str
    device: Identity
    nominal_rate: float
    measured_rate: float | None = None
    rate_uncertainty: float | None = None
    samples: int = 0
    lost: int = 0


@dataclass(frozen=True, slots=True)
class ClockAlignment:
    """How the clocks of the streams were brought together.

    Parameters
    ----------
    method : str
        Such as ``"shared clock"``, ``"recorded copy"``, ``"edge"``, ``"drift of the fundamental"``;
        ``"none"`` if they were not.
    ratio, ratio_uncertainty : float, optional
        Rate of the measuring clock over that of the output, and its standard uncertainty.
    delay, delay_uncertainty : float, optional
        Trigger delay: time of the first measured sample after the first output sample (s), and its
        standard uncertainty. None: not known, and then a loop cannot be told from a delay.
    remark : str
        What a reader must know.
    """

    method: str
    ratio: float | None = None
    ratio_uncertainty: float | None = None
    delay: float | None = None
    delay_uncertainty: float | None = None
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Scale:
    """How a channel came from what the device gave: value = gain * (raw - offset).

    Parameters
    ----------
    channel : str
        Name in the recording.
    gain, offset : float
        In units of the channel per raw unit, and in raw units.
    raw_unit : str
        Unit the device gave.
    calibration : str
        Where gain and offset come from: certificate, date, data sheet.
    """

    channel: str
    gain: float = 1.0
    offset: float = 0.0
    raw_unit: str = ""
    calibration: str = ""


@final
@dataclass(frozen=True, slots=True)
class Provenance:
    """All that is known about an acquisition besides its samples.

    Parameters
    ----------
    samples : int
        Samples N of the recording.
    origin, rate : float
        Time of sample 0 (s) and samples a second (Hz) of the recording's time base.
    streams : tuple of StreamOrigin
        Devices and rates.
    output_end : str
        One of `OUTPUT_ENDS`.
    alignment : ClockAlignment
        Clocks and trigger.
    scales : tuple of Scale
        Gains, offsets, calibrations.
    air : Air, optional
        State of the air and the index used; None: not corrected.
    envelope : mapping
        Limits that were in force, plain values.
    flags : tuple of FlagRun
        What is known against samples, in sample numbers of the recording.
    warnings : tuple of str
        Sentences of the bench, the first first.
    started : str
        Date and time of the computer, ISO 8601.
    journal, journal_sha256 : str
        Name and SHA-256 of the raw data, kept beside the recording.
    software : str
        Who wrote it.
    """

    samples: int
    origin: float
    rate: float
    streams: tuple[StreamOrigin, ...]
    output_end: str = "unknown"
    alignment: ClockAlignment = ClockAlignment("none")
    scales: tuple[Scale, ...] = ()
    air: Air | None = None
    envelope: Mapping[str, Any] = field(default_factory=dict)
    flags: tuple[FlagRun, ...] = ()
    warnings: tuple[str, ...] = ()
    started: str = ""
    journal: str = ""
    journal_sha256: str = ""
    software: str = field(default_factory=software)

    def __post_init__(self) -> None:
        """Check that it can be stored and read again."""
        if self.output_end not in OUTPUT_ENDS:
            raise UnusableInput(
                f"state of the output at the end: {self.output_end!r}; say one of "
                f"{', '.join(OUTPUT_ENDS)}"
            )
        if self.samples < 1 or not 0.0 < self.rate < np.inf:
            raise UnusableInput(f"provenance of {self.samples} samples at {self.rate} Hz")
        expanded(self.flags, self.samples)
        to_plain(fields_of(self), "provenance")

    @classmethod
    def for_recording(
        cls,
        recording: Recording,
        streams: tuple[StreamOrigin, ...],
        flags: Mapping[str, NDArray[np.uint16]],
        **others: Any,
    ) -> Self:
        """Return the provenance of samples on their final time base.

        Parameters
        ----------
        recording : Recording
            The samples.
        streams : tuple of StreamOrigin
            Devices and rates.
        flags : mapping of str to ndarray
            (N,) uint16 for every stream, on the samples of the recording.
        **others
            The other fields of this class.

        Raises
        ------
        UnusableInput
            Flags of another length, or a field that cannot be stored.
        """
        for stream, words in flags.items():
            if words.shape != recording.time.shape:
                raise UnusableInput(
                    f"{recording.name}: {words.size} flags of {stream} for {recording.n} samples"
                )
        rate = recording.fs if recording.n > 1 else streams[0].nominal_rate
        return cls(
            recording.n, float(recording.time[0]), rate, tuple(streams),
            flags=flag_runs(flags), **others,
        )  # fmt: skip

    def to_plain(self) -> dict[str, Any]:
        """Return plain values, as they are stored."""
        return {"schema": SCHEMA, **fields_of(self)}

    @classmethod
    def from_plain(cls, content: Any) -> Self:
        """Return what `to_plain` made plain.

        Raises
        ------
        UnusableInput
            One line: another version, a field missing, unknown or of another type.
        """
        found = content.get("schema") if isinstance(content, Mapping) else None
        if found != SCHEMA:
            raise UnusableInput(f"provenance of form {found!r}, this version reads {SCHEMA!r}")
        fields = {k: v for k, v in content.items() if k != "schema"}
        return made_from(cls, fields, "provenance")

    @classmethod
    def of(cls, recording: Recording) -> Self:
        """Return the provenance stored in a recording.

        Raises
        ------
        UnusableInput
            It holds none, or it cannot be read.
        """
        if KEY not in recording.meta:
            raise UnusableInput(
                f"{recording.name}: holds no provenance; only recordings of `bondsight acquire` do"
            )
        return cls.from_plain(recording.meta[KEY])


def flags_of(recording: Recording, stream: str | None = None) -> NDArray[np.uint16]:
    """Return what is known against every sample, also of a part or after decimation.

    Parameters
    ----------
    recording : Recording
        With provenance; as recorded, sliced or decimated.
    stream : str, optional
        Flags of one stream only; otherwise those of all.

    Returns
    -------
    ndarray
        (N,) uint16, sums of `Flag`. After decimation a sample has the flags of all samples that
        its filter reached.

    Raises
    ------
    UnusableInput
        There is no provenance, or the time base is another one (resampled).
    """
    origin = Provenance.of(recording)
    runs = [r for r in origin.flags if stream is None or r.stream == stream]
    words = expanded(runs, origin.samples)
    place = (recording.time - origin.origin) * origin.rate
    at = np.rint(place).astype(np.int64)
    if at[0] < 0 or at[-1] >= words.size or np.max(np.abs(place - at)) > 0.01:
        raise UnusableInput(
            f"{recording.name}: its samples are not those that were recorded; take the flags "
            "before resampling"
        )
    step = int(np.max(np.diff(at))) if at.size > 1 else 1
    if step == 1:
        return words[at]
    reach = _FILTER_REACH * step
    low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, words.size)
    out = np.zeros(at.size, np.uint16)
    for bit in range(16):
        on = np.concatenate(([0], np.cumsum(words >> bit & 1)))
        out |= ((on[high] > on[low]).astype(np.uint16) << np.uint16(bit)).astype(np.uint16)
    return out
