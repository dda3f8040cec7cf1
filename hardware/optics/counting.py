"""What a fringe is worth, by equation (4.2) of the stack actuator thesis."""

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


def _positive(name: str, value: float) -> None:
    if not 0.0 < value < float("inf"):
        raise UnusableInput(f"{name} = {value!r}; give a positive finite number")
