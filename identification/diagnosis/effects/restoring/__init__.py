"""Effects in what gives a displacement back: springs, contacts, gaps."""

from typing import Any


def __getattr__(name: str) -> Any:
    """Serve the name of the module that this folder replaces until its users name the file."""
    from importlib import import_module

    if name == "NonlinearStiffness":
        return import_module(f"{__name__}.nonlinear_stiffness").NonlinearStiffness
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
