"""What a record has to say about the output that drove it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from hardware.contracts import Identity
from hardware.envelope.limits import Converter, Envelope
from hardware.envelope.state import OutputStatus


def provenance(
    identity: Identity,
    envelope: Envelope,
    converter: Converter | None,
    status: OutputStatus,
    *,
    clamp: bool,
    cuts: int,
    faults: Sequence[str],
    probe: float,
    monitor: str,
) -> dict[str, Any]:
    """Return plain values: texts, numbers, lists and mappings only."""
    return {
        "output": asdict(identity),
        "envelope": envelope.as_dict(),
        "converter": None if converter is None else asdict(converter),
        "clamp": clamp,
        "clamped_commands": cuts,
        "has_watchdog": status.has_watchdog,
        "state": status.state.value,
        "state_if_program_dies": "parked" if status.has_watchdog else "unknown",
        "volts": status.volts,
        "status": str(status),
        "faults": list(faults),
        "probe": probe,
        "monitor": monitor,
    }
