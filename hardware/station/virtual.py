"""The station of a virtual bench, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bondgraph.support.errors import UnusableInput


def station_table(addresses: Mapping[str, str], config: Any, library: str) -> dict[str, Any]:
    """Return the station of a virtual bench as plain values.

    Parameters
    ----------
    addresses : mapping
        Address of each device by name.
    config : BenchConfig
        What it is made of.
    library : str
        Path of the stub library of the interferometer.
    """
    table: dict[str, Any] = {
        "name": "virtual bench",
        "envelope": {"preset": "P-840.1-unipolar"},
        "clock": {"bench": addresses["control"], "ppm": config.card.ppm},
    }
    if "card" in addresses:
        table["output"] = {
            "kind": config.card_model.lower(), "address": addresses["card"],
            "trigger": 0, "clock": 0,
        }  # fmt: skip
        table |= _behind_the_card(config)
    elif "gcs" in addresses:
        table["output"] = {"kind": "gcs", "address": addresses["gcs"], "trigger": 1}
    else:
        raise UnusableInput("bench serve: only a card or a GCS controller gets a station file")
    if "interferometer" in addresses:
        host, _, port = addresses["interferometer"].rpartition(":")
        table["interferometer"] = {
            "connection": f"net:{host}:{port}", "library": library,
            "dead_path": config.air.dead_path, "clocked": config.clocked,
        }  # fmt: skip
    if "gauge" in addresses:
        table["gauge"] = {"connection": addresses["gauge"], "rate": config.gauge.rate}
    return table


def _behind_the_card(config: Any) -> dict[str, Any]:
    """Return what stands behind the card, and the envelope where it is no stack."""
    told: dict[str, Any] = {}
    if config.driver == "amplifier":
        told["amplifier"] = {
            "name": "simulated amplifier", "gain": config.gain, "offset": config.offset,
            "voltage_monitor": 0.05,
        }  # fmt: skip
    else:
        what = "C-184.161" if config.driver == "ultrasonic" else "oscillator"
        told["envelope"] = {
            "name": what, "v_min": -10.0, "v_max": 10.0, "slew": 1e5, "gentle": 100.0,
            "update_period": 2e-4,
        }  # fmt: skip
        told |= {"ultrasonic": {}} if config.driver == "ultrasonic" else {"amplifier": {}}
    if config.readout:
        channel, unit = ("x", "m") if config.driver == "amplifier" else ("lag", "1")
        told["readout"] = {"channel": channel, "unit": unit, "scale": config.readout}
    return told


def stub_library() -> str:
    """Compile the stub of the vendor's library into the user's cache; returns its path."""
    from hardware.simulators.siosifm import build

    try:
        return str(build())
    except OSError as error:
        raise UnusableInput(f"bench: {error}") from None
