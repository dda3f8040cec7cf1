"""What a fringe is worth: displacement, resolution, speed and duration.

Equations (4.2) and (4.3) of the stack actuator thesis. Its 8-bit converters give 1.24 nm with 256
increments a fringe of half a wavelength and 0.62 nm with 512; its 1 nm needs 316.
"""

from __future__ import annotations

from bondgraph.support.errors import UnusableInput


def wavelength_in_air(vacuum: float, index: float) -> float:
    """Wavelength (m) in air of refraction index `index`.

    Examples
    --------
    >>> round(wavelength_in_air(632.9908e-9, 1.00027133) * 1e9, 3)
    632.819
    """
    _positive("vacuum wavelength", vacuum)
    _positive("refraction index", index)
    return vacuum / index


def displacement_per_fringe(vacuum: float, index: float = 1.0, factor: int = 2) -> float:
    """Displacement (m) of one fringe, equation (4.2) with k = 1.

    Parameters
    ----------
    vacuum : float
        Vacuum wavelength (m).
    index : float
        Refraction index of the air.
    factor : int
        How often the light runs along the displacement; 2 for a plane mirror seen once.

    Examples
    --------
    >>> round(displacement_per_fringe(632.9908e-9, 1.00027133) * 1e9, 2)
    316.41
    """
    if factor < 1:
        raise UnusableInput(f"interferometer factor {factor}: it is 2 for one mirror, 4 for two")
    return wavelength_in_air(vacuum, index) / factor


def increments_of_bits(bits: int, both_signs: bool = False) -> int:
    """Increments a fringe of quadrature signals read by converters of `bits` bits.

    Parameters
    ----------
    bits : int
        Of the arctangent table's phase.
    both_signs : bool
        Twice as many, if the bits resolve half a turn and the signs tell which half.
    """
    if not 1 <= bits <= 52:
        raise UnusableInput(f"{bits} bits of interpolation; give 1 to 52")
    return (1 << bits) << int(both_signs)


def smallest_step(vacuum: float, increments: int, index: float = 1.0, factor: int = 2) -> float:
    """Resolution (m) with `increments` a fringe, equation (4.3).

    Examples
    --------
    >>> round(smallest_step(632.8e-9, 256) * 1e9, 2), round(smallest_step(632.8e-9, 316) * 1e9, 2)
    (1.24, 1.0)
    """
    if increments < 1:
        raise UnusableInput(f"{increments} increments a fringe; give at least 1")
    return displacement_per_fringe(vacuum, index, factor) / increments


def largest_speed(
    rate: float, vacuum: float, fringes_per_sample: float = 0.5, index: float = 1.0, factor: int = 2
) -> float:
    """Largest speed (m/s) at which fringes are told apart.

    Parameters
    ----------
    rate : float
        Rate (Hz) at which the quadrature is looked at by whoever counts: the stored one if the
        phase is unwrapped from the record, the counter's own one otherwise.
    vacuum : float
        Vacuum wavelength (m).
    fringes_per_sample : float
        At most 0.5 with quadrature; less with a margin.
    index, factor
        As in `displacement_per_fringe`.

    Examples
    --------
    >>> round(largest_speed(1e6, 632.8e-9) * 1e3)  # mm/s
    158
    """
    _positive("rate", rate)
    if not 0.0 < fringes_per_sample <= 0.5:
        raise UnusableInput(
            f"{fringes_per_sample:g} fringes a sample: above 0.5 the direction is lost"
        )
    return rate * fringes_per_sample * displacement_per_fringe(vacuum, index, factor)


def largest_rate(samples: int, duration: float) -> float:
    """Largest rate (Hz) at which a block of `samples` lasts `duration` (s)."""
    _positive("duration", duration)
    _positive("samples", samples)
    return samples / duration


def block_duration(samples: int, rate: float) -> float:
    """Duration (s) of a block of `samples` at `rate` (Hz).

    Examples
    --------
    >>> round(block_duration(32768, 3125.0), 3), round(block_duration(32768, 1e6) * 1e3, 1)
    (10.486, 32.8)
    """
    _positive("samples", samples)
    _positive("rate", rate)
    return samples / rate


def _positive(name: str, value: float) -> None:
    if not 0.0 < value < float("inf"):
        raise UnusableInput(f"{name} = {value!r}; give a positive finite number")
