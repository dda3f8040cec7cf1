"""``bondsight calibrate``: the circle of the interferometer, and averaged forces."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, real_number, unknown_name
from bondsight.cli.arguments import OUT
from bondsight.cli.output import writable

if TYPE_CHECKING:
    from hardware.optics import Lissajous

POOR_HEAD = {
    "fronts": ["interferometer", "card"],
    "quadrature": {"offset_cosine": 0.04, "offset_sine": -0.03, "ratio": 1.07, "phase": 0.07},
}
"""The virtual bench to calibrate on: a head that needs it."""


def add_calibrate_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("calibrate", help="circle of the interferometer, averages of forces")
    p.add_argument("what", help="interferometer, or force")
    p.add_argument(
        "source", nargs="?", type=Path,
        help="interferometer: a station file (its reference mirror vibrates, nothing is driven) "
        "or the journal of a take with quadrature; a virtual bench if left out. force: a recording "
        "of bondsight regulate --controller force",
    )  # fmt: skip
    p.add_argument("--seconds", type=float, default=0.5, help="of the vibration (default 0.5)")
    p.add_argument(
        "--settle", type=float, default=0.2, metavar="SECONDS",
        help="force: what is left out after every step of the voltage (default 0.2)",
    )  # fmt: skip
    p.add_argument("--name", default="calibration", help="of the journal and the figure")
    p.add_argument("--out", type=Path, default=OUT, help="folder (default: %(default)s)")
    p.set_defaults(run=_calibrate)


def _calibrate(options: argparse.Namespace) -> int:
    kinds = {"interferometer": _interferometer, "force": _force}
    if options.what not in kinds:
        raise unknown_name("calibration", options.what, "the bench", kinds)
    return kinds[options.what](options)


def _interferometer(options: argparse.Namespace) -> int:
    from bondsight.cli.acquire import check_name
    from bondsight.cli.figures import save_figure
    from hardware.optics import lissajous
    from hardware.storage import open_journal

    check_name(options.name)
    writable(options.out)
    source = options.source
    if source is None or source.suffix != ".journal":
        source = _vibrated(options)
    data = open_journal(source).read("interferometer")
    if not {"sin", "cos"} <= set(data.channels):
        raise UnusableInput(
            f"{source.name}: has no sine and cosine; say [interferometer] quadrature = true in the "
            "station file and take anew, or give the station file for the reference mirror"
        )
    found = lissajous(data.channels["cos"], data.channels["sin"])
    print(f"circle:     {'thin and closed' if found.good else 'not good'}, {data.n} samples over "
          f"{found.fit.arc:.3g} fringes")  # fmt: skip
    for sentence in found.sentences:
        print(f"note:       {sentence}")
    values = ", ".join(f"{k} = {v:.6g}" for k, v in asdict(found.fit.ellipse).items())
    print(f"station:    [interferometer] ellipse = {{ {values} }}")
    print(f"figure:     {save_figure(options.out / f'{options.name}.png', lambda: _figure(found))}")
    return 0


def _vibrated(options: argparse.Namespace) -> Path:
    """Let the reference mirror vibrate, and return the journal of what was seen."""
    from bondsight.cli.bench_serve import bench_config
    from bondsight.cli.virtual_bench import served
    from hardware.station import read_settings

    real_number("--seconds", options.seconds)
    if options.source is not None:
        return _journal(options, read_settings(options.source))
    with served(bench_config(POOR_HEAD, seed=0)) as bench:
        return _journal(options, bench.settings)


def _journal(options: argparse.Namespace, settings: Any) -> Path:
    from hardware.devices.interferometer import vibrating
    from hardware.station import open_station
    from hardware.storage import Journal, StreamOrigin, journal_header

    path = Path(options.out / f"{options.name}.journal")
    with open_station(settings) as bench:
        device = bench.interferometer
        if device is None:
            raise UnusableInput(f"{settings.name}: the station has no [interferometer]")
        origin = StreamOrigin("interferometer", device.identity, 16e3)
        header = journal_header(options.name, (origin,), command={"mirror": options.seconds})
        with Journal.create(path, header) as journal:
            vibrating(device, options.seconds, journal.append)
    print(f"raw data:   {path}")
    return path


def _figure(found: Lissajous) -> Any:
    import matplotlib.pyplot as plt
    import numpy as np

    figure, ax = plt.subplots(figsize=(4.2, 4.2), layout="constrained")
    step = max(found.cosine.size // 4000, 1)
    ax.plot(found.cosine[::step], found.sine[::step], ".", ms=1.5, label="signals")
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.plot(*found.fit.ellipse.signals(turn), lw=0.8, label="ellipse")
    radius = found.fit.ellipse.radius
    ax.plot(radius * np.cos(turn), radius * np.sin(turn), "--", lw=0.8, label="circle")
    ax.set(aspect="equal", xlabel="cosine (count)", ylabel="sine (count)")
    ax.legend(loc="center")
    return figure


def _force(options: argparse.Namespace) -> int:
    import numpy as np

    from bondgraph.signals.recording import Recording
    from hardware.devices.gauge import plateaus

    if options.source is None:
        raise UnusableInput("calibrate force: give a recording with V and F, see regulate")
    recording = Recording.open(options.source)
    for name in ("V", "F"):
        if name not in recording.channels:
            raise unknown_name("channel", name, options.source.name, recording.channels)
    skip = round(real_number("--settle", options.settle) * recording.fs)
    found = plateaus(np.asarray(recording["V"]), np.asarray(recording["F"]), max(skip, 0))
    print("     V         F (N)     u (N)   kept  outliers")
    for a in found:
        print(f"{a.volts:6.2f}  {a.mean:12.4f}  {a.uncertainty:8.4f}  {a.kept:5d}  {a.excluded:8d}")
    print(
        "note:       outliers lie beyond 3.5 robust standard deviations of their neighbours' "
        "median; u counts readings that hang together as fewer"
    )
    return 0
