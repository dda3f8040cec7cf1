"""``bondsight studio``: one page to look at a diagnosis with."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import OUT
from bondsight.cli.diagnose import add_diagnosis_options, diagnose_files
from bondsight.cli.output import words_of

if TYPE_CHECKING:
    from identification.diagnosis.studio.live import LiveStudio

MOST = 200
"""Files of a folder looked at for a recording."""


def add_studio_command(verbs: Any) -> None:
    """Add ``studio VERDICT-FOLDER|RECORDING --model M`` to the sub-commands."""
    p = verbs.add_parser("studio", help="diagnose again, or watch while it searches")
    p.add_argument(
        "recordings", nargs="+", metavar="RECORDING",
        help="what `diagnose` takes, or the folder of a verdict: its recording, known by its hash "
        "in the folder, beside it or here, is diagnosed again",
    )  # fmt: skip
    shown = add_diagnosis_options(p, None, "that of the folder, else 0")
    shown.add_argument(
        "--live", action="store_true",
        help="show the steps in a browser of this machine while they are made, then the page",
    )  # fmt: skip
    p.set_defaults(run=_run, json=False)


def _run(options: argparse.Namespace) -> int:
    if len(options.recordings) == 1 and Path(options.recordings[0]).is_dir():
        folder = Path(options.recordings[0])
        options.recordings, seed = recordings_of(folder)
        options.seed = seed if options.seed is None else options.seed
        options.out = folder if options.out == OUT else options.out
    options.seed = options.seed or 0
    if not options.live:
        return diagnose_files(options)[0]
    from identification.diagnosis.studio.live import LiveStudio

    with LiveStudio() as live:
        words_of(options)(f"studio:  {live.address}")
        code, _ = diagnose_files(options, watch=stoppable(live))
        kept_open(live, options.out, say=words_of(options))
    return code


def kept_open(
    live: LiveStudio,
    folder: Path,
    offers: Sequence[str] = (),
    *,
    say: Callable[[str], None],
) -> int | None:
    """Show the page in `folder` until the user interrupts, or asks for one of the takes."""
    live.finish((folder / "report.html").read_text("utf-8"), offers)
    say(f"{live.address} shows it until Ctrl-C")
    with suppress(KeyboardInterrupt):
        return live.wait()
    return None


def stoppable(live: LiveStudio) -> Callable[[str, float], None]:
    """Return a progress that tells `live`, and ends the search as Ctrl-C does once it is asked.

    What was asked before it began, such as during a take, does not count.
    """
    from bondgraph.support.deadline import SEARCHED

    live.go_on()

    def told(text: str, fraction: float) -> None:
        live(text, fraction)
        if live.stopped and fraction < SEARCHED:
            raise KeyboardInterrupt

    return told


def recordings_of(folder: Path) -> tuple[list[str], int]:
    """Return the files that the verdict in `folder` was made from, and its seed.

    Raises
    ------
    UnusableInput
        There is no verdict, or a recording is not found by its hash; one line says which.
    """
    from hashlib import sha256

    from bondgraph.signals.files.any_file import ENDINGS
    from identification.diagnosis.verdict.reading import read_verdict

    if not (folder / "verdict.json").exists():
        raise UnusableInput(
            f"the folder {folder} holds no verdict.json: give the folder that a diagnosis wrote, "
            "or a recording"
        )
    found = read_verdict(folder / "verdict.json")
    whole = found["recording"]
    wanted = {p["sha256"]: p["name"] for p in whole.get("parts") or [whole]}
    around = dict.fromkeys(p.resolve() for p in (folder, folder.parent, Path()))
    known: dict[str, str] = {}
    for place in around:
        files = [f for f in sorted(place.iterdir()) if f.suffix.lower() in ENDINGS and f.is_file()]
        known |= {sha256(f.read_bytes()).hexdigest(): str(f) for f in files[:MOST]}
    for digest, name in wanted.items():
        if digest not in known:
            raise UnusableInput(
                f"the recording {name} of {folder / 'verdict.json'} is not in that folder, beside "
                "it or here; give the recording itself: bondsight studio RECORDING --model M"
            )
    return [known[d] for d in wanted], int(found["seed"])
