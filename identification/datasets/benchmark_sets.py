"""Sets with published protocols: `nonlinearbenchmark.org` and its official splits."""

from __future__ import annotations

from identification.datasets import benchmark_readers as read
from identification.datasets.public_set import Original, PublicSet

__all__ = ["BENCHMARK_SETS"]

_LICENCE = (
    "public nonlinearbenchmark.org benchmark; licence of the data not found, cite the authors"
)
_SILVERBOX = ("biaslab/nsi-silverbox", "728f07e4539d4f7da76a4778b52a756260b488ac")
_WIENER = ("gsmfnc/LPV_SysId", "a843d61efb1401308c932bd77b6653446bbdd351")
_DYNONET = ("forgi86/dynonet", "56699401b141065a45403a18977333e0ec8d7303")
_DRGP = ("RomanFoell/DRGP-VSS", "457f35ffd321cdfe9359d1df707fde9a32041c9c")
_EMPS = ("meco-group/nlgreyfast", "7a29c1a0eb6392855d908f07f06160d50cdf8599")
_MIRROR = ("merijnfloren/fsm-benchmark-data", "539a12fef384b086a8562b500498b2fa3899ef70")
_F16 = (
    "emckenzie11/F16_Benchmark_Restoring_Force_ODE",
    "e45e0a98628cf2c283aa896e4fef42457deb1e93",
)
_MIRROR_FILES = tuple(
    f"{k}_{level}_{part}.npy"
    for level in read.MIRROR_LEVELS
    for part in ("train", "test")
    for k in "uy"
)

BENCHMARK_SETS = (
    PublicSet(
        name="silverbox",
        title="Silverbox: electronic Duffing oscillator (cubic stiffness)",
        citation=(
            "T. Wigren, J. Schoukens, Three free data sets for development and benchmarking in "
            "nonlinear system identification, European Control Conference 2013, pp. 2933-2938"
        ),
        licence=_LICENCE,
        folder="silverbox",
        files=(("silverbox.npz",), ("SNLS80mV.mat",)),
        originals=(Original(*_SILVERBOX, "data/Silverbox/SNLS80mV.mat"),),
        loader=read.silverbox,
        inputs=("u",),
        outputs=("y",),
        init=50,
        official="samples 40650 to 127399: first 75 % train, rest test; arrow 100 to 40574",
        note=(
            "errors in mV; arrow_no_extrapolation is the first 32000 samples of arrow_full. The "
            "official loader leaves the means in (6.1 mV of u, 0.8 mV of y) and rounds the rate to "
            "610.35 Hz; here the means of the training part are removed"
        ),
    ),
    PublicSet(
        name="wiener_hammerstein",
        title="Wiener-Hammerstein circuit: filter, diode network, filter (one-sided saturation)",
        citation=(
            "J. Schoukens, J. Suykens, L. Ljung, Wiener-Hammerstein benchmark, 15th IFAC Symposium "
            "on System Identification, Saint-Malo, 2009"
        ),
        licence=_LICENCE,
        folder="wiener-hammerstein-circuit",
        files=(("wh2009.npz",), ("WienerHammerBenchMark.mat",)),
        originals=(
            Original(
                *_WIENER,
                "noise_simulations/lpvcore/wiener_hammerstein/dataset/WienerHammerBenchMark.mat",
            ),
        ),
        loader=read.wiener_hammerstein,
        inputs=("u",),
        outputs=("y",),
        init=50,
        official="samples 5200 to 183999: first 100000 train, last 78800 test",
        note="errors in mV; means are left in",
        aliases=("wiener-hammerstein-circuit",),
    ),
    PublicSet(
        name="bouc_wen",
        title="Bouc-Wen oscillator, SIMULATED: hysteretic force with a state of its own",
        citation=(
            "J.-P. Noel, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop "
            "on Nonlinear System Identification Benchmarks, Brussels, 2016"
        ),
        licence=_LICENCE,
        folder="bouc-wen-SIMULATED",
        files=(("bouc_wen.npz",), ("train.h5", "test.h5")),
        originals=tuple(
            Original(*_DYNONET, f"examples/BW/data/Test signals/{f}")
            for f in ("train.h5", "test.h5")
        ),
        loader=read.bouc_wen,
        inputs=("F",),
        outputs=("x",),
        official="the two noise-free test records; the training record is free",
        note=(
            "errors in m, all samples scored. The multisine test is one settled period of 8192 "
            "samples: run it on its own repetition; the sweep starts from rest. The training "
            "record (five periods, with noise) is by the author of the repository"
        ),
        aliases=("bouc-wen-SIMULATED",),
    ),
    PublicSet(
        name="coupled_drives",
        title="Coupled electric drives, binary sequences: the speed sensor gives no sign",
        citation=(
            "T. Wigren, M. Schoukens, Coupled Electric Drives Data Set and Reference Models, "
            "Technical Report 2017-024, Uppsala University, 2017"
        ),
        licence=_LICENCE,
        folder="coupled-electric-drives",
        files=(("ced_prbs.csv",), ("drive.mat",)),
        originals=(Original(*_DRGP, "matlab_ip/data_raw/drive.mat"),),
        loader=read.coupled_drives,
        inputs=("u",),
        outputs=("y",),
        init=4,
        note=(
            "own parts: first 400 and last 100 samples of each of three records of +-1, +-1.5 and "
            "+-0.5 V, as the official split does with the uniform records, which are not here; not "
            "comparable with published errors"
        ),
        aliases=("coupled-electric-drives",),
    ),
    PublicSet(
        name="emps",
        title="EMPS: motor, ball screw and carriage in closed loop (Coulomb friction, offset)",
        citation=(
            "A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, Workshop on "
            "Nonlinear System Identification Benchmarks, Eindhoven, 2019"
        ),
        licence=_LICENCE,
        folder="emps",
        files=(
            ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"),
            ("emps_training.csv",),
            ("DATA_EMPS.mat",),
            ("nlid_emps_sim_data_training.mat",),
        ),
        originals=(Original(*_EMPS, "nlid_emps_sim_data_training.mat"),),
        loader=read.emps,
        inputs=("F",),
        outputs=("x",),
        init=20,
        official="DATA_EMPS train, DATA_EMPS_PULSES test",
        note=(
            "the second record is not in the public copy named: without it the last third of the "
            "first one judges, which is not comparable with published errors"
        ),
    ),
    PublicSet(
        name="steering_mirror",
        title="Fine steering mirror: three piezo actuators, three sensors, three levels",
        citation=(
            "M. Floren, L. Peri, J. De Maeyer, W. De Munter, D. Vandepitte, J.-P. Noel, "
            "Data-driven state-space identification and nonlinearity assessment of the CubeSpec "
            "Fine Steering Mirror, ISMA-USD 2024, pp. 2042-2052"
        ),
        licence="CC BY 4.0, 2025 Merijn Floren, KU Leuven",
        folder="piezo-steering-mirror",
        files=(("fsm.npz",), _MIRROR_FILES),
        originals=tuple(Original(*_MIRROR, f"data/{f}") for f in _MIRROR_FILES),
        loader=read.steering_mirror,
        inputs=("u1", "u2", "u3"),
        outputs=("y1", "y2", "y3"),
        official="six realisations train, three test, at each level",
        note=(
            "the converted copy holds 3 of 6 training and 1 of 3 test realisations. 6400 Hz, "
            "settled: each record is two periods of 8192 samples, excited to 3 kHz; run a test on "
            "its own repetition. The unit of y is not stated, metres fit its size"
        ),
        aliases=("piezo-steering-mirror",),
    ),
    PublicSet(
        name="f16",
        title="F-16 ground vibration test, full multisine, lowest level (nearly linear)",
        citation=(
            "J.-P. Noel, M. Schoukens, F-16 aircraft benchmark based on ground vibration test "
            "data, Workshop on Nonlinear System Identification Benchmarks, Brussels, 2017"
        ),
        licence=_LICENCE,
        folder="f16-ground-vibration",
        files=(("f16_fullmsine_level1.npz",),),
        originals=(Original(*_F16, "diagnostics/F16Data_FullMSine_Level1.csv"),),
        loader=read.f16,
        inputs=("F",),
        outputs=("a1", "a2", "a3"),
        note=(
            "own parts: periods 2 to 5 and 6 to 9 of one multisine (8192 samples each); both have "
            "the same excitation, so the test checks the noise, not extrapolation"
        ),
        aliases=("f16-ground-vibration",),
    ),
)
