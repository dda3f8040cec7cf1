"""From an unknown voltage gently to the safe one."""

from __future__ import annotations

from collections.abc import Callable

from hardware.contracts import Clock

_PERIOD = 0.01


def walk(
    write: Callable[[float], None], present: float | None, target: float, rate: float, clock: Clock
) -> None:
    """Write voltages from `present` to `target` (V) at no more than `rate` (V/s).

    Parameters
    ----------
    write : callable
        Sets a voltage (V).
    present : float or None
        Where the output is; where that is not known, only `target` is written.
    target : float
        Where it is to go (V).
    rate : float
        Largest rate (V/s).
    clock : Clock
        Time of the program.
    """
    step = rate * _PERIOD
    while present is not None and abs(target - present) > step:
        present += step if target > present else -step
        write(present)
        clock.sleep(_PERIOD)
    write(target)
