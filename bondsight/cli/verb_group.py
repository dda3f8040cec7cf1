"""Verbs as they are added to the command: each with a description, an example, a line of help."""

from __future__ import annotations

import argparse
from typing import Any, Final

EXAMPLES: Final = {
    "acquire": "acquire --simulated --effect hysteresis --seed 3 --diagnose stack_on_bench",
    "bench": "bench serve --station station.toml",
    "check": "check model.py",
    "demo": "demo --seed 7",
    "diagnose": "diagnose run.csv --model model.py --map x=displacement[um]",
    "draw": "draw stack_with_payload --out stack.svg",
    "effects": "effects backlash",
    "equations": "equations model.py --format latex",
    "explain": "explain bondsight-out/verdict.json",
    "export": "export model.py --format modelica",
    "fit": "fit run.csv --model model.py --guess --starts 8 --profiles",
    "identifiability": "identifiability model.py --recording run.csv",
    "models": "models resonator",
    "recordings": "recordings silverbox",
    "sizing": "sizing --frequency 200 --load-mass 0.5",
}


class VerbGroup:
    """The sub-parsers of a command; remembers what was added since it was last listed."""

    def __init__(self, verbs: Any) -> None:
        self._verbs = verbs
        self._said: list[tuple[str, str]] = []

    def add_parser(self, name: str, *, help: str = "", **more: Any) -> Any:
        """Add a verb, as `argparse` does; its help is its description too."""
        said = help.replace("%%", "%")
        self._said.append((name, said))
        example = f"example: bondsight {EXAMPLES[name]}" if name in EXAMPLES else None
        more = {"description": f"{said[:1].upper()}{said[1:]}.", "epilog": example, **more}
        formatter = argparse.RawDescriptionHelpFormatter
        return self._verbs.add_parser(name, help=help, formatter_class=formatter, **more)

    def listed(self, title: str) -> str:
        """Return the verbs added since the last call, one a line."""
        lines = [f"  {name:<16} {said}" for name, said in self._said]
        self._said = []
        return "\n".join([f"{title}:", *lines])
