"""Short runs of the protocols on the recordings: part of the training samples where they are many.

The whole runs are printed by ``bondsight published``.
"""

from __future__ import annotations

import pytest

from identification.datasets import FOLDER_VARIABLE, set_available
from tests.proof.published.catalogue import run_protocol
from tests.proof.published.emps import PUBLISHED, TOLERANCE
from tests.proof.published.outcome import Outcome

pytestmark = pytest.mark.recordings


def judged(name: str, share: float = 1.0) -> Outcome:
    if not set_available(name):
        pytest.skip(f"{name}: set {FOLDER_VARIABLE} to the folder of the recordings")
    return run_protocol(name, share=share)


@pytest.mark.long
def test_silverbox() -> None:
    made = judged("silverbox", 0.3)
    assert made.reached
    assert not made.official  # a trial
    linear = made.error("multisine, linear")
    assert linear.value == pytest.approx(6.96, rel=0.05)  # the published linear error
    assert made.error("multisine").value < 0.05 * linear.value


@pytest.mark.long
def test_wiener_hammerstein() -> None:
    made = judged("wiener_hammerstein", 0.12)
    assert made.reached
    assert made.error("last 78,800 samples, linear").value == pytest.approx(43.4, rel=0.02)


@pytest.mark.long
def test_bouc_wen() -> None:
    made = judged("bouc_wen", 0.3)
    assert made.reached
    for p in made.parameters:
        assert abs(p.distance) < 0.02, p.name


@pytest.mark.long
def test_coupled_drives() -> None:
    made = judged("coupled_drives")
    assert not made.official
    for level in ("1V", "1.5V", "0.5V"):
        signed = made.error(f"signed, linear, +-{level}").value
        linear = made.error(f"rectified, linear, +-{level}").value
        assert linear < 0.6 * signed
        assert made.error(f"rectified, dry friction, +-{level}").value < linear


@pytest.mark.long
def test_emps() -> None:
    made = judged("emps")
    assert made.reached
    assert {p.name for p in made.parameters} == {n for n, _, _ in PUBLISHED.values()}
    assert all(p.tolerance == TOLERANCE for p in made.parameters)
    if not made.official:
        assert made.error("position, fit of the free run").value < 8.0


@pytest.mark.long
def test_friction_damper() -> None:
    made = judged("friction_damper")
    assert made.reached
    assert 1.8e-3 < made.values["gap_k"] < 2.3e-3  # as the owners see it
    assert made.values["F_2_c"] > 1.1 * made.values["F_1_c"]  # the band multiplies unequally
