"""The progress of a take on the terminal and in a picture."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hardware.live import Gathering, LiveView, Snapshot, Watching
from hardware.recorder import OUTPUT, Station, TakePlan
from hardware.regulation import LOOP, LoopPlan, LoopStation


@contextmanager
def watching(
    plan: TakePlan, station: Station, *, quiet: bool = False, picture: Path | None = None
) -> Iterator[Watching]:
    """Show the steps of a take; an error that leaves the block becomes its last warning.

    Parameters
    ----------
    plan : TakePlan
    station : Station
    quiet : bool
        Print nothing; the picture is drawn all the same.
    picture : Path, optional
        PNG file that is rewritten every second.
    """
    rates = {OUTPUT: plan.rate, **{s.stream: s.rate for s in station.sensors}}
    totals = {OUTPUT: int(plan.volts.size)}
    gathering = Gathering(plan.name, station.clock, totals, duration=plan.seconds, rates=rates)
    with _shown(gathering, quiet, picture) as shown:
        yield shown


@contextmanager
def watching_loop(
    plan: LoopPlan, station: LoopStation, *, quiet: bool = False
) -> Iterator[Watching]:
    """Show the steps of a loop; see `watching`."""
    rates = {LOOP: plan.rate, station.sensor.stream: station.sensor.rate}
    n = int(plan.reference.size)
    gathering = Gathering(plan.name, station.clock, {LOOP: n}, duration=n / plan.rate, rates=rates)
    with _shown(gathering, quiet, None) as shown:
        yield shown


@contextmanager
def _shown(gathering: Gathering, quiet: bool, picture: Path | None) -> Iterator[Watching]:
    snapshot = Snapshot(picture) if picture is not None else None
    shown = Watching(gathering, None if quiet else LiveView(), snapshot)
    try:
        yield shown
    except BaseException as error:
        shown.close(str(error) or type(error).__name__)
        raise
    shown.close()
