"""What is given to an element as its law or its drive: refused at once where it is none."""

from __future__ import annotations

from bondgraph.support.errors import GraphError

DRIVE = ("law", "lag", "delay")


def require_law(of: str, law: object) -> None:
    """Refuse what is no law, such as the name of one or its class; `of` says whose it is."""
    if law is None or (not isinstance(law, type) and callable(getattr(law, "parameters", None))):
        return
    given = law.__name__ if isinstance(law, type) else repr(law)
    raise GraphError(
        f"{of}: law = {given} is no law; law takes one of bondgraph.laws, such as Coulomb(0.8) "
        "for dry friction (from bondgraph.laws import Coulomb)"
    )


def require_drive(of: str, drive: object) -> None:
    """Refuse a drive that is none, such as the bare law of one."""
    if drive is None:
        return
    if isinstance(drive, type) or not all(hasattr(drive, n) for n in DRIVE):
        raise GraphError(
            f"{of}: drive = {drive!r} is no Drive; give "
            "Drive(law=..., lag=..., delay=...) of bondgraph.graph.drives: a law of the "
            "command, the names of a time constant and of a dead time"
        )
    require_law(f"{of}: drive", getattr(drive, "law", None))
