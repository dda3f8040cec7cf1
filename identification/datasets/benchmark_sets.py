"""Sets with published protocols: `nonlinearbenchmark.org` and its official splits."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from identification.datasets import readers as read
from identification.datasets.public_set import Columns, Original, PublicSet, SetPart, alone, sides

_LICENCE = (
    "public nonlinearbenchmark.org benchmark; licence of the data not found, cite the authors"
)
_SILVERBOX = ("biaslab/nsi-silverbox", "728f07e4539d4f7da76a4778b52a756260b488ac")
_WIENER = ("gsmfnc/LPV_SysId", "a843d61efb1401308c932bd77b6653446bbdd351")
_DYNONET = ("forgi86/dynonet", "56699401b141065a45403a18977333e0ec8d7303")
_DRGP = ("RomanFoell/DRGP-VSS", "457f35ffd321cdfe9359d1df707fde9a32041c9c")
_EMPS = ("meco-group/nlgreyfast", "7a29c1a0eb6392855d908f07f06160d50cdf8599")
_MIRROR = ("merijnfloren/fsm-benchmark-data", "539a12fef384b086a8562b500498b2fa3899ef70")
_F16 = ("emckenzie11/F16_Benchmark_Restoring_Force_ODE", "e45e0a98628cf2c283aa896e4fef42457deb1e93")
_MIRROR_FILES = tuple(
    f"{k}_{level}_{part}.npy"
    for level in read.MIRROR_LEVELS
    for part in ("train", "test")
    for k in "uy"
)

_EMPS_COLUMNS = {"t": "t", "F": "vir[V]", "x": "qm[m]"}
_BOUC_WEN = ("train_multisine", "test_multisine", "test_sinesweep")
_DRIVES = tuple(enumerate(("1V", "1.5V", "0.5V"), 1))
_SILVERBOX_PARTS = (
    SetPart("train/multisine", "", *read.SILVERBOX_TRAIN),
    SetPart("test/multisine", "", read.SILVERBOX_TRAIN[1], read.SILVERBOX_STOP),
    SetPart("test/arrow_full", "", 100, 40_575),
    SetPart("test/arrow_no_extrapolation", "", 100, 32_100),
    SetPart(
        "multisine", "whole", read.SILVERBOX_TRAIN[0], read.SILVERBOX_STOP, 0.25,
        called="silverbox",
        title="Silverbox: electronic Duffing oscillator, ten odd multisines (cubic stiffness)",
    ),
    SetPart(
        "arrow", "whole", 0, 40_400, 1.0 / 3.0, called="silverbox/arrow",
        title="Silverbox: noise of growing amplitude, beyond the multisines (extrapolation)",
    ),
)  # fmt: skip
_PERIOD = 8192


def _mirror_parts(**realisations: Sequence[str]) -> tuple[SetPart, ...]:
    names = (
        f"{side}/{level}_{number}".rstrip("_")
        for side, numbers in realisations.items()
        for level in read.MIRROR_LEVELS
        for number in numbers
    )
    return tuple(SetPart(name, name) for name in names)


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
        layouts=(
            alone("silverbox.npz", u="snls80mV_u_V", y="snls80mV_y_V"),
            alone("SNLS80mV.mat", 1e7 / 2**14, u="V1[V]", y="V2[V]"),
        ),
        originals=(Original(*_SILVERBOX, "data/Silverbox/SNLS80mV.mat"),),
        inputs=("u",),
        outputs=("y",),
        parts=_SILVERBOX_PARTS,
        init=50,
        official="samples 40650 to 127399: first 75 % train, rest test; arrow 100 to 40574",
        note=(
            "errors in mV; arrow_no_extrapolation is the first 32000 samples of arrow_full. The "
            "official loader leaves the means in (6.1 mV of u, 0.8 mV of y) and rounds the rate to "
            "610.35 Hz; here the means of the training part are removed"
        ),
        prepare=read.silverbox_centred,
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
        layouts=(
            alone("wh2009.npz", u="u_V", y="y_V"),
            alone("WienerHammerBenchMark.mat", 51_200.0, u="uBenchMark[V]", y="yBenchMark[V]"),
        ),
        originals=(
            Original(
                *_WIENER,
                "noise_simulations/lpvcore/wiener_hammerstein/dataset/WienerHammerBenchMark.mat",
            ),
        ),
        inputs=("u",),
        outputs=("y",),
        parts=(
            SetPart("train/noise", "", 5200, 105_200),
            SetPart("test/noise", "", 105_200, 184_000),
        ),
        init=50,
        official="samples 5200 to 183999: first 100000 train, last 78800 test",
        note="errors in mV; means are left in",
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
        layouts=(
            tuple(
                Columns("bouc_wen.npz", {"F": f"{r}_u_N", "x": f"{r}_y_m"}, record=r)
                for r in _BOUC_WEN
            ),
            tuple(
                Columns(f"{file}.h5", {"F": f"{r}/u[N]", "x": f"{r}/y[m]"}, 750.0, f"{file}_{r}")
                for file, _, r in (name.partition("_") for name in _BOUC_WEN)
            ),
        ),
        originals=tuple(
            Original(*_DYNONET, f"examples/BW/data/Test signals/{f}")
            for f in ("train.h5", "test.h5")
        ),
        inputs=("F",),
        outputs=("x",),
        parts=tuple(SetPart(r.replace("_", "/"), r) for r in _BOUC_WEN),
        official="the two noise-free test records; the training record is free",
        note=(
            "errors in m, all samples scored. The multisine test is one settled period of 8192 "
            "samples: run it on its own repetition; the sweep starts from rest. The training "
            "record (five periods, with noise) is by the author of the repository"
        ),
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
        layouts=(
            tuple(
                Columns("ced_prbs.csv", {"u": f"u{i}_V", "y": f"y{i}[1]"}, record=level)
                for i, level in _DRIVES
            ),
            tuple(
                Columns("drive.mat", {"u": f"u{i}[V]", "y": f"z{i}[1]"}, 50.0, level)
                for i, level in _DRIVES
            ),
        ),
        originals=(Original(*_DRGP, "matlab_ip/data_raw/drive.mat"),),
        inputs=("u",),
        outputs=("y",),
        parts=tuple(
            SetPart(f"{side}/{level}", level, *span)
            for _, level in _DRIVES
            for side, span in (("train", (0, 400)), ("test", (400, 500)))
        ),
        init=4,
        note=(
            "own parts: first 400 and last 100 samples of each of three records of +-1, +-1.5 and "
            "+-0.5 V, as the official split does with the uniform records, which are not here; not "
            "comparable with published errors"
        ),
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
        layouts=(
            (
                Columns("DATA_EMPS.mat", _EMPS_COLUMNS),
                Columns("DATA_EMPS_PULSES.mat", _EMPS_COLUMNS, record="pulses"),
            ),
            alone("emps_training.csv", F="drive_voltage_V", x="position_m"),
            alone("DATA_EMPS.mat", **_EMPS_COLUMNS),
            alone("nlid_emps_sim_data_training.mat", **_EMPS_COLUMNS),
        ),
        originals=(Original(*_EMPS, "nlid_emps_sim_data_training.mat"),),
        inputs=("F",),
        outputs=("x",),
        parts=(
            SetPart("train/record"),
            SetPart("test/pulses", "pulses"),
            SetPart("record", held=1.0 / 3.0, called="emps"),
        ),
        otherwise=sides(Fraction(2, 3), test="last_third"),
        init=20,
        official="DATA_EMPS train, DATA_EMPS_PULSES test",
        note=(
            "the second record is not in the public copy named: without it the last third of the "
            "first one judges, which is not comparable with published errors"
        ),
        prepare=read.emps_force,
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
        layouts=((Columns("fsm.npz", {}),), tuple(Columns(f, {}) for f in _MIRROR_FILES)),
        originals=tuple(Original(*_MIRROR, f"data/{f}") for f in _MIRROR_FILES),
        inputs=("u1", "u2", "u3"),
        outputs=("y1", "y2", "y3"),
        parts=_mirror_parts(train="123456", test="123"),
        otherwise=_mirror_parts(train="123", test=("",)),
        official="six realisations train, three test, at each level",
        note=(
            "the converted copy holds 3 of 6 training and 1 of 3 test realisations. 6400 Hz, "
            "settled: each record is two periods of 8192 samples, excited to 3 kHz; run a test on "
            "its own repetition. The unit of y is not stated, metres fit its size"
        ),
        reader=read.steering_mirror,
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
        layouts=(
            alone(
                "f16_fullmsine_level1.npz",
                F="force_N",
                a1="acc1_m_s2",
                a2="acc2_m_s2",
                a3="acc3_m_s2",
            ),
        ),
        originals=(Original(*_F16, "diagnostics/F16Data_FullMSine_Level1.csv"),),
        inputs=("F",),
        outputs=("a1", "a2", "a3"),
        parts=(  # the first period is not settled
            SetPart("train/periods_2_to_5", "", _PERIOD, 5 * _PERIOD),
            SetPart("test/periods_6_to_9", "", 5 * _PERIOD, 9 * _PERIOD),
        ),
        note=(
            "own parts: periods 2 to 5 and 6 to 9 of one multisine (8192 samples each); both have "
            "the same excitation, so the test checks the noise, not extrapolation"
        ),
    ),
)
