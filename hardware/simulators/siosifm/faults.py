"""What can be wrong with the simulated interferometer; set at any time, also while it runs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Faults:
    """Faults of the device; sample numbers count from the start of the running measurement.

    Parameters
    ----------
    beam_loss_at : int, optional
        From this sample on the counter is off by `fringes`, and `beam_bits` are set until the next
        zero.
    fringes : int
        Whole half wavelengths (about 316.4 nm) lost.
    beam_bits : int
        Status bits of the loss: 1 quadrant jump, 2 level low.
    fade_from : int, optional
        From this sample on the light fades ...
    fade_samples : int
        ... to nothing within so many samples.
    overrun_at : int, optional
        From this sample on ...
    overrun_samples : int
        ... so many are lost in the device's own buffer.
    no_trigger : bool
        The start trigger is never seen.
    late_samples : int
        The first sample comes so many periods after (negative: before) its instant.
    laser_unstable_at : int, optional
        From this sample on the laser is not stable.
    stale_air : bool
        The sensors of the air have stopped; their last values stay.
    temperature, pressure, humidity : float, optional
        What the sensors say instead of the truth: degC, Pa, %.
    mirror_stroke : float
        Amplitude of the reference mirror's vibration (m); it fades with age.
    cut_after_bytes : int, optional
        The cable is pulled after so many more bytes.
    silent : bool
        The device does not answer any more.
    """

    beam_loss_at: int | None = None
    fringes: int = 1
    beam_bits: int = 3
    fade_from: int | None = None
    fade_samples: int = 1000
    overrun_at: int | None = None
    overrun_samples: int = 100
    no_trigger: bool = False
    late_samples: int = 0
    laser_unstable_at: int | None = None
    stale_air: bool = False
    temperature: float | None = None
    pressure: float | None = None
    humidity: float | None = None
    mirror_stroke: float = 0.4e-6
    cut_after_bytes: int | None = None
    silent: bool = False
