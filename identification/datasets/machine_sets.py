"""Sets of single machines; their parts are our own unless the note says otherwise."""

from __future__ import annotations

from fractions import Fraction

from identification.datasets import readers as read
from identification.datasets.public_set import Columns, Original, PublicSet, SetPart, alone, sides

_DRGP = ("RomanFoell/DRGP-VSS", "457f35ffd321cdfe9359d1df707fde9a32041c9c")
_ARM = ("Rafa7046/Non_Linear_Identification", "e5c9b006b0a2ec1650bc018a5fb38d2f4363d4c7")
_PENDULUM = ("dynamicslab/MultiArm-Pendulum", "e99a7e13fe2adc8fc647321a156b6cb59a48a698")
_CYLINDER = ("EvaZillen/3D-printed-pneumatic-actuator", "6e0bcb4633bd53b2a8544cdbd497c4c06539afc7")
_PINION = ("KonradMnich/friction-identification", "8b477df1747f606c68387096b613b9fae01aa8a6")
_BEAM = ("elchape99/SSCSA", "aaf445cbb0df3616089fa3c7ab309bfdfd2b8695")
_PIEZO = ("chandratue/SmartHysteresis", "e7672dabcabbc75341e9ea965d073f68b27e5cda")
_PNZT = ("mavasbel/matlab-preisach-model", "e083eb995b8f7c84e06e8d1ac58ac564aec539ee")
_DAMPER = (
    "ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash",
    "0e09aa9d950760277e31c08cd93fd01f39a5af09",
)
_MOTO = ("gergelytakacs/AutomationShield", "bc0778f97a156d4ea5158725e09068d438e59a39")
_SERVO = ("mauicv/servo-sysid", "e4a48407899108cae084ff25e8b5d12e3da070cc")
_TCLAB = ("rawlings-group/mlid_2024", "9f1c939c2efb81bc57c7459404fc04dfcf36b910")
_NONE = "none stated by the repository: do not redistribute"
_DAISY = "DaISy: licence not verified, the database asks for citation"
_DE_MOOR = "B. De Moor (ed.), DaISy: Database for the Identification of Systems, KU Leuven"
_PNZT_FILES = (
    "record1_60s", "record2_60s", "record3_105s", "record4_1400s",
    "loop01_0p1Hz_1400V", "loop02_0p01Hz_1400V", "loop03_1Hz_800V", "loop04_1Hz_1000V",
    "loop05_1Hz_1200V", "loop06_1Hz_1400V", "loop07_1Hz_800V", "loop08_1Hz_800V",
    "loop09_1Hz_800V", "loop10_1Hz_800V",
)  # fmt: skip
_SEALS = ("O_ring_1bar", "O_ring_3bar", "O_ring_5bar", "O_ring_7bar", "X_ring257_3bar")
_BANDS = {
    "harmonic_0p5Hz_1in_70lb": "dataset-1/characterization datasets/0.5Hz70lbtension.json",
    "harmonic_0p25Hz_1p5in_36lb": (
        "dataset-2/characterization datasets/0.25Hz36lbtension1.5amplitude.json"
    ),
    "harmonic_0p5Hz_1in_30lb": (
        "dataset-2/characterization datasets/0.5Hz30lbtension1amplitude.json"
    ),
    "harmonic_1Hz_0p5in_36lb": (
        "dataset-2/characterization datasets/1Hz36lbtension0.5amplitude.json"
    ),
    "earthquake_imperial_valley_DBE": "dataset-2/earthquake profiles/ImperialValleyDBE.json",
    "earthquake_kocaeli_MCE": "dataset-2/earthquake profiles/KocaeliMCE.json",
}
_HEATERS = ("open_loop_prbs", "closed_loop_setpoints", "closed_loop_collapse")
_ROLLOUTS = tuple(f"rollout_{i:02d}" for i in range(read.SERVO_ROLLOUTS))
_LAST_THIRD = sides(Fraction(2, 3))
_PNZT_COLUMNS = {
    "V": "voltage_V", "i": "current_A", "P": "polarization_uC_per_cm2", "x": "displacement_nm",
}  # fmt: skip
_HEATER_COLUMNS = {
    "Q1": "heater_1_percent[%]", "Q2": "heater_2_percent[%]",
    "T1": "temperature_1_C[degC]", "T2": "temperature_2_C[degC]",
}  # fmt: skip
_BAND_COLUMNS = {
    "x": "displacement_m", "v": "velocity_m_per_s", "F": "force_N",
    "F1": "band_end_1_force_N", "F2": "band_end_2_force_N",
}  # fmt: skip
_CYLINDER_COLUMNS = {"clock": "t_s[s]", "x": "position_mm", "p": "pressure_bar", "F": "force_N"}


def _whole_parts(records: tuple[str, ...], judged: tuple[str, ...]) -> tuple[SetPart, ...]:
    return tuple(SetPart(f"{'test' if r in judged else 'train'}/{r}", r) for r in records)


MACHINE_SETS = (
    PublicSet(
        name="piezo_actuator",
        title="Piezoelectric actuator: 3.26 s of rest, then a 150 V, 1 Hz sine (hysteresis)",
        citation=(
            "Discovery of sparse hysteresis models for piezoelectric materials, Applied Physics "
            "Letters 2023, doi 10.1063/5.0146134"
        ),
        licence=_NONE,
        folder="piezo-actuator-sine",
        layouts=(alone("sine_150V_1Hz.csv", V="voltage_V", x="displacement_um"),),
        originals=(Original(*_PIEZO, "Data/hysteresis_v_150_1hz.csv"),),
        inputs=("V",),
        outputs=("x",),
        parts=(
            SetPart("train/periods", held=1.0 / 3.0, drive="V"),
            SetPart("test/last_periods", held=1.0 / 3.0, drive="V"),
            SetPart("sine", held=1.0 / 3.0, drive="V", called="piezo-actuator-sine"),
        ),
        note="own parts: whole periods, the last two judge; the rest before them is left out",
    ),
    PublicSet(
        name="pnzt_creep",
        title="PNZT ceramic: voltage steps with rests, and loops (butterfly, creep, leakage)",
        citation=(
            "B. Jayawardhana et al., Modeling and analysis of butterfly loops via Preisach "
            "operators and its application in a piezoelectric material, CDC 2018"
        ),
        licence=_NONE,
        folder="pnzt-ceramic-creep",
        layouts=(tuple(Columns(f"{f}.csv", _PNZT_COLUMNS, record=f) for f in _PNZT_FILES),),
        originals=tuple(
            Original(*_PNZT, f"Remnant_Measurements_2/remnant_measurements/trap/{f}")
            for f in ("RMN_TRAP_1400V_1000V_CREEP.dat", "RMN_TRAP_SLOW.dat")
        ),
        inputs=("V",),
        outputs=("i", "P", "x"),
        parts=_whole_parts(
            _PNZT_FILES, tuple(f for f in _PNZT_FILES if f not in ("record1_60s", "record3_105s"))
        ),
        note="own parts: records 1 and 3 train; record 4 holds instrument drift",
    ),
    PublicSet(
        name="piezo_beam",
        title="Cantilever with two short-circuited piezo patches: exciter current to velocity",
        citation=(
            "A. Bono, A. Chiappe, A. Di Donna, S. Lombardi, N. Torre, Smart coupled systems for "
            "sensing and actuation, University of Genoa"
        ),
        licence=_NONE,
        folder="piezo-shunt-beam",
        layouts=(alone("time_short_short_new.npz", 1000.0, i="coil_current_A", v="velocity[1]"),),
        originals=(Original(*_BEAM, "FRF"),),
        inputs=("i",),
        outputs=("v",),
        parts=_LAST_THIRD,
        init=1000,
        note="own parts: the last third judges; the unit of the velocity is not stated",
    ),
    PublicSet(
        name="mr_damper",
        title="Magnetorheological damper: velocity to force (yield force, hysteresis)",
        citation=(
            "J. Wang, A. Sano, T. Chen, B. Huang, Identification of Hammerstein systems without "
            "explicit parameterisation of non-linearity, Int. J. Control 82 (2009) 937-952"
        ),
        licence="distributed with a commercial toolbox: internal use",
        folder="mr-damper",
        layouts=(
            alone("mr_damper.csv", v="velocity_cm_per_s", F="force_N"),
            alone("damper.mat", 200.0, v="X[cm/s]", F="y[N]"),
        ),
        originals=(Original(*_DRGP, "matlab_ip/data_raw/damper.mat"),),
        inputs=("v",),
        outputs=("F",),
        parts=sides(2000),
        init=10,
        note="customary parts: first 2000 samples, rest; units as the toolbox documents them",
    ),
    PublicSet(
        name="pendulum",
        title="Pendulum on ball bearings, free swings (Coulomb friction, drag)",
        citation=(
            "K. Kaheman, U. Fasel, J. J. Bramburger, B. Strom, J. N. Kutz, S. L. Brunton, The "
            "Experimental Multi-Arm Pendulum on a Cart, arXiv 2205.06231"
        ),
        licence="MIT",
        folder="pendulum-free-swing",
        layouts=(
            (
                Columns("small_swing.csv", {"theta": "angle_rad"}, record="small_swing"),
                Columns(
                    "large_swing.csv",
                    {"theta": "angle_rad", "omega": "angular_velocity_rad_per_s"},
                    record="large_swing",
                ),
            ),
        ),
        originals=(
            Original(*_PENDULUM, "Datas/SinglePendulum/SingleDataFreeSwing_1_Dt_0_0001.mat"),
            Original(
                *_PENDULUM,
                "ParameterEstimation/SinglePendulum/SinglePendulumDataForParameterEstimation.mat",
            ),
        ),
        inputs=(),
        outputs=("theta",),
        parts=_whole_parts(("small_swing", "large_swing"), ("large_swing",)),
        init=10,
        note="own parts: the small swing trains, the large one judges; its omega is smoothed",
        prepare=read.hanging_angle,
    ),
    PublicSet(
        name="rack_and_pinion",
        title="Rack and pinion drive, one stroke: speed to force (Stribeck, tooth ripple)",
        citation="K. Mnich, friction-identification, README of the repository",
        licence=_NONE,
        folder="rack-and-pinion-friction",
        layouts=(alone("merged.csv", v="velocity_m_per_s", F="force_N"),),
        originals=tuple(Original(*_PINION, f"input/{f}") for f in ("a3NI.csv", "a3MR.csv")),
        inputs=("v",),
        outputs=("F",),
        parts=_LAST_THIRD,
        init=10,
        note="own parts: the last third judges; one direction only",
    ),
    PublicSet(
        name="pneumatic_cylinder",
        title="Printed pneumatic cylinder: seal friction at four pressures and two seals",
        citation="E. Zillen, 3D printed pneumatic actuators, MSc thesis, TU Delft",
        licence="CC0 1.0",
        folder="pneumatic-cylinder-friction",
        layouts=(
            tuple(Columns(f"{f}.csv", _CYLINDER_COLUMNS, read.CYLINDER_RATE, f) for f in _SEALS),
        ),
        originals=tuple(
            Original(
                *_CYLINDER,
                f"results_pneumatic-actuator/data/friction/{f.replace('_ring', '-ring')}.csv",
            )
            for f in _SEALS
        ),
        inputs=("x", "p"),
        outputs=("F",),
        parts=_whole_parts(_SEALS, ("O_ring_5bar", "X_ring257_3bar")),
        init=10,
        note=(
            "own parts: O-ring at 1, 3 and 7 bar train; 5 bar and the X-ring judge. Stretches "
            "without a pause of the logger, resampled to 100 Hz; p is above ambient"
        ),
        prepare=read.longest_stretches,
    ),
    PublicSet(
        name="hair_dryer",
        title="Hair dryer: heater voltage to air temperature reading (dead time, second lag)",
        citation=f"{_DE_MOOR}, [96-006] hair dryer",
        licence=_DAISY,
        folder="daisy-mechatronics",
        layouts=(
            alone("hair_dryer.csv", u="heater_voltage_V", y="air_temperature_V"),
            *(
                alone("dryer.mat", 12.5, u=f"{u}[V]", y=f"{y}[V]")
                for u, y in (("u2", "y2"), ("u", "y"), ("X", "y"))
            ),
        ),
        originals=(Original(*_DRGP, "matlab_ip/data_raw/dryer.mat"),),
        inputs=("u",),
        outputs=("y",),
        parts=(*sides(500), SetPart("record", held=1.0 / 3.0, called="hair_dryer")),
        init=10,
        note="customary parts: first and last 500 samples",
        aliases=("daisy-mechatronics/hair_dryer",),
    ),
    PublicSet(
        name="ball_and_beam",
        title="Ball and beam: beam angle to ball position (rolling friction, end stops)",
        citation=f"{_DE_MOOR}, [96-004] ball and beam",
        licence=_DAISY,
        folder="daisy-mechatronics",
        layouts=(
            alone("ball_and_beam.csv", angle="beam_angle_rad", x="ball_position_m"),
            alone("ballbeam.mat", 10.0, angle="X[rad]", x="y[m]"),
        ),
        originals=(Original(*_DRGP, "matlab_ip/data_raw/ballbeam.mat"),),
        inputs=("angle",),
        outputs=("x",),
        parts=sides(500),
        init=10,
        note="customary parts: first and last 500 samples",
        aliases=("daisy-mechatronics/ball_and_beam",),
    ),
    PublicSet(
        name="flexible_arm",
        title="Flexible robot arm: reaction torque to acceleration (lightly damped modes)",
        citation=f"{_DE_MOOR}, [96-009] flexible robot arm",
        licence=_DAISY,
        folder="daisy-mechatronics",
        layouts=(
            alone("flexible_robot_arm.csv", 1.0, u="reaction_torque[1]", y="arm_acceleration[1]"),
        ),
        originals=(Original(*_ARM, "src/data/robot-arm.csv"),),
        inputs=("u",),
        outputs=("y",),
        parts=_LAST_THIRD,
        init=10,
        note=(
            "own parts: the last third judges; units and sample time are not published, so the "
            "time counts samples"
        ),
        aliases=("daisy-mechatronics/flexible_robot_arm",),
    ),
    PublicSet(
        name="friction_damper",
        title="Banded rotary friction damper: velocity to force (dry friction, backlash)",
        citation=(
            "A. Downey, L. Cao, S. Laflamme, D. Taylor, J. Ricles, High capacity variable friction "
            "damper based on band brake technology, Engineering Structures 113 (2016) 287-298; "
            "data by D. Coble, P. Huggins, L. Cao, J. Ricles, A. Downey, 2022"
        ),
        licence="CC BY-SA 4.0",
        folder="friction-damper-backlash",
        layouts=(tuple(Columns(f"{r}.csv", _BAND_COLUMNS, record=r) for r in _BANDS),),
        originals=tuple(Original(*_DAMPER, f"data/{path}") for path in _BANDS.values()),
        inputs=("x", "v"),
        outputs=("F",),
        parts=_whole_parts(tuple(_BANDS), tuple(r for r in _BANDS if r.startswith("earthquake"))),
        init=10,
        note=(
            "own parts: harmonic displacements train, earthquakes judge. The converted copy is in "
            "SI and thinned from 1024 to 256 Hz behind a zero-phase filter; F counts with the "
            "velocity, F1 and F2 are the ends of the band. The first and last 16 samples are "
            "edges of the filter"
        ),
    ),
    PublicSet(
        name="motoshield",
        title="Small DC motor on two boards: voltage to speed (Coulomb torque, concave curve)",
        citation="G. Takacs, J. Boldocky, E. Mikulas et al., AutomationShield project: MotoShield",
        licence="CC BY-NC-ND 4.0: converted files are not redistributed",
        folder="motoshield-dc-motor",
        layouts=(
            tuple(
                Columns(
                    f"{board}_steps.csv", {"u": "voltage_V", "w": "speed_rad_per_s"}, record=board
                )
                for board in read.MOTO_PULSES
            ),
        ),
        originals=tuple(
            Original(*_MOTO, f"matlab/examples/MotoShield/{f}")
            for f in ("aprbsResult.mat", "identification_data.mat")
        ),
        inputs=("u",),
        outputs=("w",),
        parts=_whole_parts(tuple(read.MOTO_PULSES), ("board2",)),
        init=5,
        note=(
            "own parts: board 1 trains, board 2, another motor with a finer counter, judges; 50 "
            "Hz. The current reading of board 2 is no current of the motor and is left out"
        ),
        prepare=read.motor_pulses,
    ),
    PublicSet(
        name="hobby_servo",
        title="Hobby servo with a weighted arm: angle command to angle (limits, dry friction)",
        citation="mauicv, servo-sysid, repository, 2026",
        licence=_NONE,
        folder="hobby-servo-arm",
        layouts=(
            alone("rollouts.csv", 50.0, u="command_rad", q="angle_rad", rollout="rollout[1]"),
        ),
        originals=(Original(*_SERVO, "src/sysid/dataset/dataset.json"),),
        inputs=("u",),
        outputs=("q",),
        parts=_whole_parts(_ROLLOUTS, _ROLLOUTS[::3]),
        init=2,
        note=(
            "own parts: every third rollout judges. 0 chirp; 1-30 steps; 31-51 random binary; "
            "52-63 ramps; 64-75 triangles; 76-95 squares; each from rest, timed by software"
        ),
        prepare=read.rollouts,
    ),
    PublicSet(
        name="tclab",
        title="Two transistor heaters, two temperature sensors (sensor lag, radiation, room)",
        citation=(
            "S. J. Kuntz, J. B. Rawlings, Maximum likelihood identification of linear models with "
            "integrating disturbances for offset-free control, arXiv 2406.03760; device: J. Park, "
            "R. A. Martin, J. D. Kelly, J. D. Hedengren, Computers & Chemical Engineering 135 "
            "(2020) 106736"
        ),
        licence="MIT",
        folder="tclab-heaters",
        layouts=(tuple(Columns(f"{f}.csv", _HEATER_COLUMNS, record=f) for f in _HEATERS),),
        originals=tuple(
            Original(*_TCLAB, f"data/{f}") for f in ("tclab_prbs.pickle", "tclab_cl.pickle")
        ),
        inputs=("Q1", "Q2"),
        outputs=("T1", "T2"),
        parts=_whole_parts(_HEATERS, _HEATERS[2:]),
        init=60,
        note=(
            "own parts: the open loop and the loop of set-points train, the loop that collapses "
            "judges; 1 s. Heaters count as shares of full power, temperatures from 0 C; that of "
            "the room is not recorded. Entries 'Reg. & Cons. ML' and 'Unregularized ML' of the "
            "second file"
        ),
    ),
)
