"""The ultrasonic plate actuator: its numbers printed, its figures written, topic by topic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bondgraph.support.errors import UnusableInput, unknown_name
from bondsight.cli.ultrasonic_drive import characteristic, driver, resonance, wires
from bondsight.cli.ultrasonic_figure import Draw, save_figure
from bondsight.cli.ultrasonic_motion import closed_loop, open_loop

TOPICS: dict[str, Callable[[], tuple[int, Draw]]] = {
    "characteristic": characteristic,
    "driver": driver,
    "wires": wires,
    "open_loop": open_loop,
    "closed_loop": closed_loop,
    "resonance": resonance,
}
"""Each prints its numbers and returns how many panels its figure has and what draws them."""


def ultrasonic(folder: Path, topics: Sequence[str] = ()) -> int:
    """Print the numbers of the named topics, or of all, and write one figure each.

    Parameters
    ----------
    folder : Path
        Made if absent; gets ``ultrasonic_<topic>.png``.
    topics : sequence of str
        Of `TOPICS`.

    Raises
    ------
    UnknownName
        A topic does not exist.
    UnusableInput
        The folder is a file.
    """
    for t in topics:
        if t not in TOPICS:
            raise unknown_name("topic", t, "ultrasonic", TOPICS)
    if folder.exists() and not folder.is_dir():
        raise UnusableInput(f"{folder} is a file; give a folder for the figures")
    folder.mkdir(parents=True, exist_ok=True)
    for t in topics or TOPICS:
        print(f"== {t}")
        panels, draw = TOPICS[t]()
        print(f"figure: {save_figure(folder / f'ultrasonic_{t}.png', panels, draw)}")
    return 0
