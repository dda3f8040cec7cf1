"""Draining of many values: by a compiled loop where there is gcc, by ctypes where there is none."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.native import build
from hardware.devices.interferometer.constants import Aux
from hardware.devices.interferometer.library import VendorLibrary

_SOURCE = Path(__file__).parent / "c" / "pump.c"
_FLAGS = ("-O2", "-std=c11", "-shared", "-fPIC")
_ORDER = (Aux.COSINE, Aux.SINE, Aux.NORM, Aux.CLOCK, Aux.SAMPLE)


@dataclass(frozen=True, slots=True, eq=False)
class Drained:
    """Values as the library gave them.

    Parameters
    ----------
    length : (n,) array
        nm.
    status : (n,) array
        Status word of each.
    aux : dict of Aux to (n,) array
        What was asked for beside.
    code : int
        Negative answer that ended it early; 0 if none did.
    """

    length: NDArray[np.float64]
    status: NDArray[np.uint32]
    aux: dict[Aux, NDArray[np.int32]]
    code: int = 0


def drain(
    library: VendorLibrary,
    device: int,
    count: int,
    wanted: Sequence[Aux],
    *,
    channel: int = 0,
    oldest: int | None = None,
    native: bool = True,
) -> Drained:
    """Read values out of the buffer of the library.

    The status is asked for after every value. Whether it belongs to the value or is the device's
    present state is not public; read like this no bad sample can look good either way, since the
    state of the beam holds until the next zero.

    Parameters
    ----------
    library : VendorLibrary
        The library.
    device : int
        Its handle.
    count : int
        How many; there must be so many.
    wanted : sequence of Aux
        Columns beside length and status.
    channel : int
        Beam.
    oldest : int, optional
        Read by age from here on, without taking them out of the buffer; by default the oldest are
        taken out.
    native : bool
        False for the loop in Python in any case.

    Returns
    -------
    Drained
        Values read.
    """
    x = np.empty(count)
    state = np.empty(count, np.uint32)
    aux = {kind: np.empty(count, np.int32) for kind in wanted}
    code = ctypes.c_int32(0)
    call = compiled() if native else None
    if call is None:
        done = _by_hand(library, device, channel, oldest, x, state, aux, code)
    else:
        columns = (ctypes.c_void_p * 5)(
            *(aux[kind].ctypes.data if kind in aux else None for kind in _ORDER)
        )
        recent = None if oldest is None else _address(library, "IfmGetRecentValues")
        done = call(
            _address(library, "IfmGetValues"),
            recent,
            _address(library, "IfmLengthValue"),
            _address(library, "IfmAuxValue"),
            _address(library, "IfmStatus"),
            device,
            channel,
            oldest or 0,
            count,
            x.ctypes.data,
            state.ctypes.data,
            columns,
            ctypes.byref(code),
        )
    return Drained(x[:done], state[:done], {k: v[:done] for k, v in aux.items()}, code.value)


def _by_hand(
    library: VendorLibrary,
    device: int,
    channel: int,
    oldest: int | None,
    x: NDArray[np.float64],
    state: NDArray[np.uint32],
    aux: dict[Aux, NDArray[np.int32]],
    code: ctypes.c_int32,
) -> int:
    take, by_age = library.function("IfmGetValues"), library.function("IfmGetRecentValues")
    length, status = library.function("IfmLengthValue"), library.function("IfmStatus")
    beside = library.function("IfmAuxValue")
    for k in range(x.size):
        answer = take(device) if oldest is None else by_age(device, oldest - k)
        if answer < 0:
            code.value = answer
            return k
        x[k] = length(device, channel)
        state[k] = status(device, channel)
        for kind, column in aux.items():
            column[k] = beside(device, channel, int(kind))
    return x.size


def _address(library: VendorLibrary, name: str) -> int | None:
    return ctypes.cast(library.function(name), ctypes.c_void_p).value


@cache
def compiled() -> Any:
    """Return the compiled loop; None without gcc."""
    path = build(_SOURCE.read_text(encoding="utf-8"), _FLAGS)
    if path is None:
        return None
    function = ctypes.CDLL(str(path)).pump
    pointer, number = ctypes.c_void_p, ctypes.c_int32
    function.restype = number
    function.argtypes = [pointer] * 5 + [number] * 4 + [pointer] * 4
    return function
