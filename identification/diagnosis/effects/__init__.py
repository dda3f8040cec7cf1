"""The catalogue: every effect the diagnosis can name, one class each."""

from __future__ import annotations

import importlib
import inspect
import pkgutil

from identification.diagnosis.effects.effect import Effect as Effect
from identification.diagnosis.effects.effect import Insertion as Insertion


def _all() -> tuple[Effect, ...]:
    found = {}
    for p in pkgutil.walk_packages(__path__, __name__ + "."):
        try:
            m = importlib.import_module(p.name)
        except Exception as error:
            print("SKIPPED", p.name, error)
            continue
        for _, c in inspect.getmembers(m, inspect.isclass):
            if issubclass(c, Effect) and not inspect.isabstract(c) and c.__module__ == p.name:
                found[c.name] = c()
    return tuple(found.values())


_EVERY = _all()
CATALOGUE: tuple[Effect, ...] = tuple(e for e in _EVERY if e.name != "unknown")
UNNAMED: Effect = next(e for e in _EVERY if e.name == "unknown")


def by_name(name: str) -> Effect:
    """Effect of the catalogue by its name."""
    return {e.name: e for e in (*CATALOGUE, UNNAMED)}[name]
