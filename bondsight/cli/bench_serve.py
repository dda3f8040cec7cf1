"""``bondsight bench serve``: a virtual bench whose devices speak their real protocols."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import nonnegative
from bondsight.cli.checkout import evidence, has_evidence


def add_bench_serve_options(p: argparse.ArgumentParser) -> None:
    """Add the options of ``serve``."""
    g = p.add_argument_group("bench serve")
    g.add_argument("--config", type=Path, default=None, help="plant, clocks, air, faults (TOML)")
    g.add_argument("--effect", default=None, help="conceal this effect ('drawn' leaves it open)")
    g.add_argument("--place", default=None, help="at this element")
    g.add_argument("--strength", default=None, help="weak, medium or strong")
    g.add_argument("--seed", type=nonnegative, default=None, help="draw of the plant")
    g.add_argument("--reveal", action="store_true", help="print the sealed truth at the end")
    g.add_argument(
        "--station", type=Path, default=None, help="write the station file for bondsight acquire"
    )
    g.add_argument("--ready", type=Path, default=None, help="write addresses as JSON when ready")
    g.add_argument("--end", type=Path, default=None, help="end and reveal when this file appears")
    g.add_argument(
        "--parent", type=nonnegative, default=None, metavar="PID", help="end with this process"
    )


def bench_serve(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from hardware.simulators.bench_server import serve

    if len(options.what) > 1:
        raise UnusableInput(f"bench serve takes options only, not {' '.join(options.what[1:])}")
    config = bench_config(
        options.config, effect=options.effect, place=options.place, strength=options.strength,
        seed=options.seed,
    )  # fmt: skip
    if options.station is not None:
        _check_station(options.station)
    try:
        return serve(
            config, plants=plants(), reveal=options.reveal, ready_file=options.ready,
            reveal_request=options.end, parent=options.parent,
            started=None if options.station is None else station_writer(options.station, config),
        )  # fmt: skip
    except ValueError as error:
        raise UnusableInput(str(error)) from None


def bench_config(source: Path | Mapping[str, Any] | None, **said: Any) -> Any:
    """Return the bench of a file, or of plain values, with what is `said` of its plant instead."""
    from dataclasses import replace

    from hardware.simulators.bench_server import load_config
    from hardware.simulators.bench_server.config import config_from

    try:
        config = load_config(source) if isinstance(source, Path) else config_from(source or {})
        given: dict[str, Any] = {k: v for k, v in said.items() if v is not None}
        return replace(config, plant=replace(config.plant, **given)) if given else config
    except ValueError as error:
        raise UnusableInput(str(error)) from None


def _trial(plant: str, cell: str) -> Any:
    """Return a maker of the sealed trial's plants."""

    def make(config: Any) -> Any:
        import secrets

        from hardware.simulators.bench_server import Stand

        trial = evidence("tests.proof.trial.bench_plant", "bench serve")
        seed = secrets.randbits(31) if config.seed is None else config.seed
        found = (
            trial.trial_plant(plant) if config.effect == "none" else trial.drawn(seed, plant, cell)
        )
        return Stand(found, {"seed": seed, "plant": plant, **trial.truth_of_plant(found)})

    return make


def _model(name: str) -> Any:
    """Return a maker of a model of the catalogue."""

    def make(config: Any) -> Any:
        from actuators.models.catalogue import MODELS
        from bondgraph.graph.elements import Source
        from bondgraph.graph.sensors import Sensor
        from hardware.simulators.bench_server import Stand
        from hardware.virtual import ModelPlant

        graph = MODELS[name]()
        sources = [e.name for e in graph.of_type(Source) if e.unit == "V"]
        lengths = [e.name for e in graph.of_type(Sensor) if e.unit == "m"]
        if not sources or not lengths:
            raise ValueError(f"bench: {name} has no source in V, or no sensor in m")
        return Stand(ModelPlant(graph, sources[0], lengths[0]), {"model": name})

    return make


def plants() -> dict[str, Any]:
    """Return the makers of all plants beside the virtual stack."""
    from actuators.models.catalogue import MODELS
    from hardware.simulators.bench_server import MACHINES

    cells = {"trial-stack": "single", "trial-stack-outside": "outside"} if has_evidence() else {}
    trial = {name: _trial("stack", cell) for name, cell in cells.items()}
    return {**trial, **MACHINES, **{f"model-{n}": _model(n) for n in MODELS}}


def _check_station(path: Path) -> None:
    if not path.parent.is_dir():
        raise UnusableInput(f"{path.parent}: there is no such folder; make it first")


def station_writer(path: Path, config: Any) -> Any:
    """Return what writes the station file of a started bench and tells how to use it."""

    def write(addresses: dict[str, str]) -> list[str]:
        from bondgraph.support.whole_file import replacing
        from hardware.station.settings import toml_text
        from hardware.station.virtual import station_table, stub_library

        text = toml_text(station_table(addresses, config, stub_library()))
        with replacing(path) as stream:
            stream.write(text.encode())
        # a controller gives an edge at the start only, and an acquire line has to work as it is
        way = "" if "card" in addresses else " --synchronise start"
        return [f"  bondsight acquire {path}{way} --diagnose stack_on_bench"]

    return write
