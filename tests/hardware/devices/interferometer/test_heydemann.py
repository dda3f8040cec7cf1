"""Raw quadrature through the library and the ellipse correction of the program."""

from __future__ import annotations

import numpy as np

from hardware.devices.interferometer import Block
from hardware.optics import fit_ellipse, quadrature_displacement
from hardware.simulators.siosifm import Quadrature
from tests.hardware.devices.interferometer.bench import GAIN, joined, make_bench


def test_correction_from_raw_quadrature_takes_the_periodic_error_away() -> None:
    shape = Quadrature(offset_cosine=0.03, offset_sine=-0.04, ratio=1.07, phase=np.radians(4.0))
    with make_bench(quadrature=shape) as bench:
        block = Block(bench.device, 4001, 10_000.0, start=False, extras=("sin", "cos"))
        block.kickoff()
        for k in range(400):
            bench.rig.drive(0.025 * k)  # 1 um in steps of 2.5 nm
            bench.rig.wait(0.001)
        chunks = block.poll()
        environment = bench.device.environment()
        block.finish()
    x, u1, u2 = (joined(chunks, k) for k in ("x", "cos", "sin"))
    ellipse = fit_ellipse(u1, u2).ellipse
    own = quadrature_displacement(
        u1, u2, ellipse, environment.vacuum_wavelength, environment.air.index
    )
    rest = np.arange(5, 4000, 10)
    true = 0.025 * GAIN * np.arange(400)
    assert np.ptp(x[rest] - true) > 5e-9
    assert np.ptp(own[rest] - true) < 0.3e-9
