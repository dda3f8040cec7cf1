"""Effects that take energy from a mechanical motion."""

from typing import Any


def __getattr__(name: str) -> Any:
    """Serve the names of the module that this folder replaces until its users name the files."""
    from importlib import import_module

    files = {"CoulombFriction": "coulomb", "StribeckFriction": "stribeck", "Drag": "quadratic_drag"}
    if name in files:
        return getattr(import_module(f"{__name__}.{files[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
