# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # An ultrasonic plate actuator, from its data sheet to a closed loop
#
# The M-661 pushes a stage by a plate that vibrates at 215 kHz. Its driver C-184.161 turns a control
# voltage of -10 to 10 V into that vibration. What can be said before the first measurement?
#
# **Nothing here is measured.** There are three kinds of numbers, and every section says which it
# uses:
#
# - *printed*: the data sheets, tables 3.2 and 4.1 of the stack actuator thesis;
# - *told*: facts in words of its chapter 8, whose curves exist as drawings only;
# - *assumed*: everything else. Where a conclusion hangs on it, it is varied.

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import HTML, display

from actuators import ultrasonic as us
from bondgraph import simulate
from bondgraph.drawing.svg import svg
from bondsight import equations

# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update(
    {
        "figure.figsize": (8.0, 2.9),
        "figure.dpi": 90,
        "figure.constrained_layout.use": True,
        "font.size": 8,
        "axes.grid": True,
        "grid.alpha": 0.3,
    }
)

# %% [markdown]
# ## The data sheet
#
# First: do the printed numbers agree with each other?

# %%
sheet = us.M661
print(
    f"voltage   {sheet.voltage_peak_to_peak:g} V peak to peak as a sine: {sheet.sine_rms:.1f} V rms"
)
print(
    f"power     {sheet.supply:g} V x {sheet.current:g} A = {sheet.supply_power:g} W, "
    f"printed {sheet.power:g} W"
)
print(f"damper    push force over velocity: {sheet.damping:g} N s/m")
print(
    f"useful    at most {1e3 * sheet.largest_output:g} mW, "
    f"{100 * sheet.largest_output / sheet.power:g} % of the power"
)
assert round(sheet.sine_rms) == sheet.voltage_rms == 42
assert abs(sheet.supply_power / sheet.power - 1) < 0.05
assert sheet.damping == 2.0
assert sheet.largest_output / sheet.power == 0.025

# %% [markdown]
# They do, if the 400 mA are drawn from the 12 V supply; through the plate they would be 17 VA.

# %% [markdown]
# ## Bond graph
#
# The source bears the name and the colour of its command, the control voltage; what it imposes is
# a force that depends on it. A mass and a damper share the speed of the stage. The strokes are the
# causality: the mass integrates, the damper answers a speed with a force.
#
# Printed: the damper, as 1 N over 500 mm/s. Assumed: a moved mass of 10 g, a third of the actuator.

# %%
graph = us.ultrasonic_stage()
assert graph.check() == ()
for name, parameter in graph.parameters.items():
    print(f"{name} = {parameter.value:g} {parameter.unit}  ({parameter.source})")
display(HTML(svg(graph)))

# %%
model = equations(graph)
assert model.states == ("p_m", "q_x")
print(model)
model

# %% [markdown]
# ## Voltage to force: a table as law
#
# `V_c_drive` is a table. Told: no force within 2 V to either side, a quick rise, the largest force
# from about 6 V on; measured for positive voltages and mirrored. Printed: 1 N. Assumed: the points
# between 2 V and 6 V. A measured characteristic would replace them and nothing else.
#
# The inverse linearises the drive. It jumps over the dead zone, and it needs no more than 6 V.

# %%
law = us.voltage_force()
print("V_c / V  " + " ".join(f"{k:6g}" for k in law.knots))
print("F / N    " + " ".join(f"{v + 0.0:6g}" for v in law.values))

volt, newton = np.linspace(-10, 10, 2001), np.linspace(-1, 1, 2001)
fig, (left, right) = plt.subplots(1, 2)
left.axvspan(-2, 2, color="0.9", label="dead zone (told)")
left.plot(volt, us.force(volt), label="straight lines (used)")
smooth = simulate(
    us.ultrasonic_stage(law=us.voltage_force(join="pchip")),
    1e-4 * np.arange(volt.size),
    {"V_c": volt},
    x0=np.zeros(2),
    observed=("e_V_c",),
    hold="linear",
)
left.plot(volt, smooth["e_V_c"], "--", lw=0.9, label="monotone cubic")
left.plot(law.knots, law.values, "k.", label="points")
left.set(xlabel="control voltage / V", ylabel="force / N", title="characteristic")
left.set_xticks(range(-10, 11, 2))
left.legend(loc="upper left")
right.plot(newton, us.control_voltage(newton))
right.set(xlabel="wanted force / N", ylabel="control voltage / V", title="inverse")
plt.show()

assert np.all(us.force(volt[np.abs(volt) <= 2]) == 0)
assert np.allclose(us.force(volt[np.abs(volt) >= 6]), np.sign(volt[np.abs(volt) >= 6]))
assert np.allclose(us.force(us.control_voltage(newton)), newton)
assert np.abs(us.control_voltage(newton)[newton != 0]).min() >= 2
between = float(np.abs(smooth["e_V_c"] - us.force(volt)).max())
print(f"the way of joining the points changes the force by at most {between:.3f} N")
assert between < 0.1

# %% [markdown]
# ## Step responses and direction
#
# Left: speed of the free stage after a step, by simulation of the graph. The end speed is `F / b`;
# between 6 V and 10 V nothing is gained, at 1.5 V nothing moves. The mechanics has no preferred
# direction.
#
# Right: the driver's output has one. Told: from -9 V to 9 V takes twice as long to settle as from
# -4 V to 4 V, and 0.1 ms longer in the opposite direction. A linear lag would give the ratio 1, a
# pure slew limit 2.25; a lag with a slew limit has both facts. Assumed: the lag, `Q / (pi f)` with
# `Q` = 100. The text has no other time scale.

# %%
time = 1e-5 * np.arange(4001)
driver = us.fitted_driver()
print(
    f"driver: lag {1e3 * driver.lag:.3f} ms, at most {1e-3 * driver.upward:.2f} V/ms up and "
    f"{1e-3 * driver.downward:.2f} V/ms down"
)
fig, (left, right) = plt.subplots(1, 2)
for control in (10.0, 6.0, 4.0, 3.0, 1.5, -3.0, -4.0, -10.0):
    step = simulate(
        graph, time, {"V_c": np.full(time.size, control)}, x0=np.zeros(2), hold="linear"
    )
    dashes = "--" if control == 6.0 else "-"
    left.plot(1e3 * time, 1e3 * step["v"], dashes, label=f"{control:g} V")
    assert abs(step["v"][-1] - us.force(control) / sheet.damping) < 5e-4
left.set(xlabel="time / ms", ylabel="speed / (mm/s)", xlim=(0, 40), title="stage after a step")
left.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))

fine = 1e-6 * np.arange(4001)
settled = {}
for start, end in ((-4, 4), (4, -4), (-9, 9), (9, -9)):
    output = us.envelope(fine, np.where(fine > 0.5e-6, float(end), float(start)), driver)
    outside = np.flatnonzero(np.abs(output - end) > 0.05 * abs(end - start))
    settled[start, end] = fine[outside[-1]]
    right.plot(1e3 * fine, output, label=f"{start} V to {end} V")
right.axhspan(-2, 2, color="0.9", label="dead zone")
right.set(xlabel="time / ms", ylabel="output / V of control", xlim=(0, 2.5), title="driver")
right.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()
for (start, end), seconds in settled.items():
    print(f"{start:2d} V to {end:2d} V: settled within 5 % after {1e3 * seconds:.2f} ms")
assert abs(settled[-9, 9] / settled[-4, 4] - 2) < 0.01
assert abs(settled[9, -9] - settled[-9, 9] - 0.1e-3) < 5e-6

# %% [markdown]
# Both together: a reversal at full speed, and how much of it is the driver. The driver's time scale
# is assumed, so it is varied: both facts can be had with any lag.

# %%
mass = graph.parameters["m"].value
for factor in (0.5, 1.0, 2.0):
    varied = us.fitted_driver(factor * driver.lag)
    crossed = {}
    for sign in (1, -1):
        output = us.envelope(time, np.where(time > 5e-6, 9.0 * sign, -9.0 * sign), varied)
        run = simulate(
            graph, time, {"V_c": output}, x0=np.array([-0.5 * sign * mass, 0.0]), hold="linear"
        )
        crossed[sign] = time[np.flatnonzero(sign * run["v"] > 0)[0]]
    powerless = 4 / varied.downward
    print(
        f"lag {1e3 * varied.lag:.3f} ms: the stage turns round {1e3 * crossed[1]:.2f} ms after the "
        f"command (upwards), {1e3 * crossed[-1]:.2f} ms (downwards); without force for "
        f"{1e3 * powerless:.2f} ms"
    )
    assert crossed[-1] > crossed[1]
    ratio = varied.settling_time(-9, 9) / varied.settling_time(-4, 4)
    assert abs(ratio - 2) < 1e-6
    if factor == 1.0:
        # the mechanics alone: v = 0.5 (2 exp(-t b / m) - 1) passes zero at ln 2 m / b
        alone = np.log(2) * mass / sheet.damping
        print(f"    the mechanics alone: {1e3 * alone:.2f} ms")
        assert 1.2 * alone < crossed[1] < crossed[-1] < 1.3 * alone

# %% [markdown]
# The stage needs `ln 2 m / b` = 3.5 ms by itself; the driver adds a quarter, or an eighth to a half
# over the varied lags. The dead zone is crossed without force.

# %% [markdown]
# ## What comes out of the three wires
#
# Told: one front electrode is excited, the other floats, the sign of the control voltage swaps
# them, every wire is measured against ground and the back electrode subtracted. Printed: 120 V peak
# to peak, 5 W. Assumed: all capacitances, the share of the back electrode, and that the amplitude
# is proportional to the control voltage. The charge that the vibration itself brings to the
# floating electrode is left out.

# %%
carrier = np.arange(64 * 4) / (64 * sheet.frequency)
wires = us.three_wire(carrier, np.full(carrier.size, 10.0))
swap = np.arange(64 * 600) / (64 * sheet.frequency)
swapped = us.three_wire(swap, np.where(swap < 0.5e-3, 9.0, -9.0))

fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.1))
for name, wire in (("back", wires.back), ("active", wires.positive), ("floating", wires.negative)):
    axes[0].plot(1e6 * carrier, wire, label=name)
axes[0].set(xlabel="time / µs", ylabel="voltage / V", title="against ground, 10 V")
axes[1].plot(1e6 * carrier, wires.active, "C1", label="active")
axes[1].plot(1e6 * carrier, wires.passive, "C2", label="floating")
axes[1].set(xlabel="time / µs", ylabel="voltage / V", title="against the back electrode, 10 V")
# too many periods to draw: the highest and the lowest value of each
for name, wire in (("positive", swapped.positive), ("negative", swapped.negative)):
    period = (wire - swapped.back).reshape(-1, 64)
    middle = 1e3 * swap.reshape(-1, 64).mean(axis=1)
    axes[2].fill_between(middle, period.min(axis=1), period.max(axis=1), alpha=0.5, label=name)
axes[2].set(xlabel="time / ms", ylabel="voltage / V", title="envelopes, 9 V to -9 V")
for a in axes:
    a.set_ylim(-70, 90)
    a.legend(loc="upper center", ncols=3, columnspacing=1.0, handlelength=1.2)
plt.show()

rms = float(np.sqrt(np.mean(wires.active**2)))
print(f"active: {np.ptp(wires.active):.1f} V peak to peak, {rms:.1f} V rms")
print(f"floating: {np.ptp(wires.passive):.1f} V peak to peak, by the assumed capacitances")
assert abs(np.ptp(wires.active) - 120) < 0.1
assert round(rms) == 42

# %% [markdown]
# The vibrating plate behind the wires: a capacitance beside a branch in resonance. The current of
# the branch is the speed of the vibration. `R_m` takes the whole printed power, which is an upper
# bound: the driver's losses are in it. `Q` = 100 and `C_0` = 1.2 nF are assumed.

# %%
plate = us.Plate()
plate_graph = us.plate_graph(plate)
assert plate_graph.check() == ()
display(HTML(svg(plate_graph)))
for name, parameter in plate_graph.parameters.items():
    print(f"{name} = {parameter.value:.4g} {parameter.unit}")
admittance = complex(plate.admittance(sheet.frequency))
watt, ampere = sheet.sine_rms**2 * admittance.real, sheet.sine_rms * abs(admittance)
print(f"at resonance: {watt:.2f} W, {1e3 * ampere:.0f} mA rms")
assert abs(watt - sheet.power) < 1e-9
assert ampere < sheet.current

# %% [markdown]
# ## Why slow motion fails in open loop
#
# Told: 3 V, little above the dead zone, gives no motion, or motion that gets stuck on the way.
# Dry friction that depends on the place does that. Assumed: friction drawn evenly from 0 to 0.5 N
# every 0.5 mm, three draws of a guide, 64 starts each.

# %%
guides = {seed: us.guided_stage(seed) for seed in (0, 1, 2)}
runs = {
    (seed, control): us.constant_voltage(control, seed=seed, stage=stage, duration=0.3)
    for seed, stage in guides.items()
    for control in (3.0, 4.0, 10.0)
}
pushes = {
    (seed, control): us.constant_voltage(control, seed=seed, stage=stage, duration=0.02)
    for seed, stage in guides.items()
    for control in (3.0, 4.0, 10.0)
}
print("guide  control  never moves  gets stuck  arrives  distance after 20 ms")
for (seed, control), r in runs.items():
    push = pushes[seed, control]
    print(
        f"{seed:5d}  {control:5g} V  {100 * r.not_started:9.1f} %  {100 * r.stuck:8.1f} %  "
        f"{100 * r.arrived:5.0f} %  {1e3 * push.moved.mean():.2f} mm +- "
        f"{100 * push.relative_spread:.0f} %"
    )

fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.0))
friction = guides[0].friction
axes[0].plot(1e3 * np.array(friction.knots), friction.values, lw=0.8, label="friction")
for control, colour in ((3.0, "C1"), (4.0, "C2")):
    axes[0].axhline(us.force(control), color=colour, label=f"force at {control:g} V")
axes[0].set(xlabel="position / mm", ylabel="force / N", title="guide 0", ylim=(0, 1.05))
axes[0].legend(loc="upper right")
for a, control in zip(axes[1:], (3.0, 10.0), strict=True):
    r = runs[0, control]
    a.plot(1e3 * r.time[::10], 1e3 * r.position[:24, ::10].T, lw=0.7)
    a.set(xlabel="time / ms", ylabel="position / mm", title=f"{control:g} V", ylim=(0, 18.5))
    a.set_xlim(0, 150)
plt.show()

for seed in guides:
    slow, sure, fast = (runs[seed, control] for control in (3.0, 4.0, 10.0))
    assert slow.not_started > 0.05
    assert slow.stuck > 0.8
    assert slow.arrived == 0
    assert sure.arrived == fast.arrived == 1
    spreads = [pushes[seed, control].relative_spread for control in (3.0, 4.0, 10.0)]
    assert spreads[0] > 0.5
    assert spreads[0] > 5 * spreads[1] > 5 * spreads[2]

# %% [markdown]
# The way out, more voltage, costs the slow motion: the voltage that is sure to pass the roughest
# place is fast where the guide is smooth. How much hangs on the assumed friction?

# %%
print("mean friction  sure from  speed where smoothest")
for mean in (0.05, 0.1, 0.2, 0.25, 0.3):
    stage = us.guided_stage(0, mean=mean)
    sure, speed = us.lowest_sure_voltage(stage), us.speed_at_sure_voltage(stage)
    print(f"{mean:11.2f} N  {sure:7.2f} V  {1e3 * speed:6.0f} mm/s")
    highest = max(stage.friction.values)
    assert abs(us.force(sure) - highest) < 1e-12
    if mean == 0.25:
        assert 3.0 < sure < 4.0
        assert speed > 0.3

# %% [markdown]
# A smooth guide would be harmless, but it would not stick at 3 V: sticking needs friction above
# the force at 3 V, here 0.4 N, so a mean of about 0.2 N or more. On such a guide nothing below 250
# to 430 of the printed 500 mm/s is sure. The 0.4 N is an assumed point of the table, so this is an
# order of magnitude.

# %% [markdown]
# ## Closed loop, and the sample rate it needs
#
# A PID controller reads the position, inverts the characteristic and holds its force. Its
# derivative cancels the lag `m / b` of the stage. One whole sample passes from reading to force and
# the hold costs half of one; both are assumed.
#
# The exact poles of the sampled loop give the lowest rate that is stable; 45 degrees of phase
# margin is a usual demand.

# %%
mass = graph.parameters["m"].value
lead = mass / sheet.damping
print("                              stable above   45 degrees above")
for crossover in (5.0, 20.0, 50.0):
    loop = us.designed(crossover, derivative=lead)
    stable, good = us.stability_rate(loop), us.margin_rate(loop)
    print(f"PID, crossover {crossover:3.0f} Hz     {stable:12.0f} Hz {good:15.0f} Hz")
    assert 6 * crossover < stable < good < 20 * crossover

loop = us.designed(20.0, derivative=lead)
limit = us.stability_rate(loop)
others = {
    "PI, crossover 20 Hz": us.designed(20.0),
    "PID 20 Hz, no delay": replace(loop, delay=0),
    "PID 20 Hz, 2 samples": replace(loop, delay=2),
    "PID 20 Hz, stage of 5 g": replace(loop, mass=5e-3),
    "PID 20 Hz, stage of 20 g": replace(loop, mass=20e-3),
}
bounds = {name: (us.stability_rate(o), us.margin_rate(o)) for name, o in others.items()}
for name, (stable, good) in bounds.items():
    print(f"{name:26s}{stable:14.0f} Hz {good:15.0f} Hz")
assert bounds["PI, crossover 20 Hz"][1] > 4 * us.margin_rate(loop)
assert bounds["PID 20 Hz, no delay"][0] < 0.5 * limit < limit < bounds["PID 20 Hz, 2 samples"][0]
assert all(abs(bounds[f"PID 20 Hz, stage of {g} g"][0] / limit - 1) < 0.1 for g in (5, 20))

# %% [markdown]
# The delay decides. That the mass is only guessed hardly moves the limit of stability; a stage
# twice as heavy as assumed costs margin.

# %% [markdown]
# Now the nonlinear loop: driver, dead zone, limit of the force, end stops, readings of 1 nm. First
# without dry friction, on both sides of the limit that the poles predict: below it a limit cycle
# over millimetres, above it rest.

# %%
smooth_runs = {
    factor: us.step_answer(loop.controller, us.Sampling(factor * limit), step=2e-4, duration=3.0)
    for factor in (0.8, 0.95, 1.05, 1.25, 2.0)
}
print(f"limit of the 20 Hz loop: {limit:.1f} Hz")
for factor, answer in smooth_runs.items():
    radius = us.spectral_radius(loop, factor * limit)
    print(
        f"{factor * limit:6.1f} Hz = {factor:4g} of it: largest pole {radius:.3f}, "
        f"swing at the end {1e6 * answer.swing:11.4f} um"
    )
    assert (radius < 1) == (factor > 1)
assert smooth_runs[0.95].swing > 1e-3
assert smooth_runs[1.25].swing < 1e-8
assert smooth_runs[2.0].error < 1e-8

# %% [markdown]
# With dry friction (the three guides, and the printed 2 N that hold the plate at rest) the
# controller adds 0.5 N towards the target to break away. That push makes the loop hunt at any of
# these rates unless it stops within a tolerance, and each tolerance asks for a rate.

# %%
kick = replace(loop.controller, breakaway=0.5)
rates = (100.0, 200.0, 500.0, 1e3, 2e3, 5e3, 16e3)
tolerances = (0.0, 1e-5, 1e-4)
rough = {
    (seed, rate, tolerance): us.step_answer(
        kick,
        us.Sampling(rate, tolerance=tolerance),
        stage=replace(stage, holding=sheet.holding_force),
        step=2e-3,
        duration=0.5,
    )
    for seed, stage in guides.items()
    for rate in rates
    for tolerance in tolerances
}
print("guide 0, swing at the end / um, tolerance:   none        10 um       100 um")
for rate in rates:
    swings = (1e6 * rough[0, rate, t].swing for t in tolerances)
    print(f"{rate:24.0f} Hz         " + " ".join(f"{w:12.2f}" for w in swings))
calm = {
    (seed, t): min(rate for rate in rates if rough[seed, rate, t].swing == 0)
    for seed in guides
    for t in tolerances[1:]
}
for (seed, t), rate in calm.items():
    print(f"guide {seed} rests within {1e6 * t:3.0f} um from {rate:4.0f} Hz on")

fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.1))
for factor in (0.95, 1.05, 1.25, 2.0):
    answer = smooth_runs[factor]
    axes[0].plot(answer.time, 1e3 * answer.position, lw=0.8, label=f"{factor * limit:.0f} Hz")
axes[0].set(xlim=(0, 0.4), ylim=(7.6, 9.0), title=f"no friction, limit {limit:.0f} Hz")
for rate in (200.0, 1e3, 5e3):
    answer = rough[0, rate, 1e-5]
    axes[1].plot(answer.time, 1e3 * answer.position, lw=0.8, label=f"{rate:.0f} Hz")
axes[1].set(xlim=(0, 0.3), ylim=(6, 15), title="guide 0, tolerance 10 µm")
axes[0].legend(loc="upper left")
axes[1].legend(loc="upper center", ncols=3, columnspacing=1.0, handlelength=1.2)
for a in axes[:2]:
    a.set(xlabel="time / s", ylabel="position / mm")
for seed in guides:
    axes[2].loglog(rates, [1e6 * rough[seed, r, 0.0].swing for r in rates], ".-", label=f"{seed}")
axes[2].set(xlabel="sample rate / Hz", ylabel="swing / µm", title="no tolerance")
axes[2].legend(loc="upper right", title="guide")
plt.show()

for seed in guides:
    without = [rough[seed, rate, 0.0].swing for rate in rates]
    assert without[0] > 5e-3
    assert without[0] > 5 * without[3] > 15 * without[5] > 0
    assert calm[seed, 1e-4] == 1e3
    assert calm[seed, 1e-5] in (2e3, 5e3)
    for t in tolerances[1:]:
        answers = [rough[seed, rate, t] for rate in rates if rate >= calm[seed, t]]
        assert all(answer.swing == 0 and answer.error <= t for answer in answers)

# %% [markdown]
# Some hundred readings a second satisfy the linear loop. Friction asks for more: 1 kHz to rest
# within 100 µm, 2 to 5 kHz within 10 µm. The thesis could not close the loop because its
# interferometer was read too slowly; it prints no rate to compare with.

# %% [markdown]
# ## Following the resonance
#
# The plate warms and its resonance falls; the drive stays where the potentiometer put it. A
# phase-locked loop holds voltage and current in phase instead. Assumed: 6 K/W, 15 s, -150 ppm/K,
# and `Q`, the quality, which is varied.

# %%
heating, lock = us.Heating(), us.PhaseLock()
tracked = {}
print("   Q  control   fixed: off    vibration  force     tracked: off   vibration  force")
for quality in (100.0, 350.0, 1000.0):
    p = us.Plate(quality=quality)
    for control in (10.0, 5.0):
        free = us.run_plate(p, heating, control=control, duration=150.0, step=2.5e-3)
        held = us.run_plate(p, heating, lock, control=control, duration=150.0, step=2.5e-3)
        tracked[quality, control] = free, held
        print(
            f"{quality:4.0f}  {control:4g} V  {free.detuning[-1]:9.0f} Hz  "
            f"{100 * free.amplitude[-1]:8.1f} %  {free.force[-1]:.3f} N  "
            f"{held.detuning[-1]:13.4f} Hz  {100 * held.amplitude[-1]:6.1f} %  "
            f"{held.force[-1]:.3f} N"
        )
        assert abs(free.detuning[-1] / us.warm_detuning(p, heating, control) - 1) < 1e-3
        assert abs(held.detuning[-1]) < 1e-3
        assert abs(held.force[-1] - us.force(control)) < 1e-6

# %% [markdown]
# At 10 V the saturated characteristic hides the detuning until less than 60 % of the vibration is
# left; at 5 V the loss of force shows at once. The sharper the resonance, the more is lost.

# %%
fig, axes = plt.subplots(1, 3, figsize=(9.5, 3.1))
for quality in (100.0, 350.0, 1000.0):
    free, held = tracked[quality, 5.0]
    axes[0].plot(free.time[::80], free.detuning[::80], label=f"fixed, Q = {quality:g}")
    axes[1].plot(free.time[::80], free.force[::80], label=f"fixed, Q = {quality:g}")
axes[0].plot(held.time[::80], held.detuning[::80], "k", label="tracked")
axes[1].plot(held.time[::80], held.force[::80], "k", label="tracked")
axes[0].set(xlabel="time / s", ylabel="drive less resonance / Hz", title="5 V", ylim=(-15, 400))
axes[1].set(xlabel="time / s", ylabel="force / N", title="5 V", ylim=(0, 1))
frequency = np.linspace(-12e3, 12e3, 1201)
y = plate.admittance(sheet.frequency + frequency)
for share in (0.0, 0.5, 0.8, 1.0):
    rest = y - share * 2j * np.pi * (sheet.frequency + frequency) * plate.capacitance
    axes[2].plot(
        1e-3 * frequency, np.degrees(np.angle(rest)), label=f"{100 * share:.0f} % subtracted"
    )
axes[2].axhline(0, color="0.4", lw=0.8)
axes[2].set(
    xlabel="drive less resonance / kHz",
    ylabel="phase of the current / degrees",
    title="whole current",
    ylim=(-95, 95),
)
axes[0].legend(loc="upper right")
axes[1].legend(loc="lower right")
axes[2].legend(loc="lower left", fontsize=7)
plt.show()
for quality, loss in ((100.0, 0.02), (350.0, 0.1), (1000.0, 0.3)):
    free, held = tracked[quality, 5.0]
    assert 1 - free.force[-1] / held.force[-1] > loss
assert tracked[100.0, 10.0][0].force[-1] > 0.999

# %% [markdown]
# The phase of the whole current is no use as it is: `C_0` carries so much that voltage and current
# are never in phase. Its current has to be subtracted first, and what remains of it bounds the
# range from which the loop finds the resonance.

# %%
bound = 0.5 / (plate.resistance * plate.omega)
print(f"without subtraction a phase of zero exists only below C_0 = {1e9 * bound:.2f} nF")
assert us.zero_phase(plate, 0.0) is None
assert np.angle(y).min() > 0
cold = us.Heating(resistance=0.0)
for share in (0.5, 0.8, 0.9):
    rest, edge = us.zero_phase(plate, share)
    wide = us.PhaseLock(compensation=share, span=30e3)
    inside, outside = (
        us.run_plate(plate, cold, wide, detuning=f * edge, duration=10.0) for f in (0.97, 1.03)
    )
    print(
        f"{100 * share:.0f} % subtracted: rests {rest:.0f} Hz too high, finds the resonance from "
        f"below {1e-3 * edge:.1f} kHz"
    )
    assert abs(inside.detuning[-1] / rest - 1) < 1e-3
    assert outside.detuning[-1] > 29e3

# %% [markdown]
# ## What to measure first
#
# 1. The characteristic between 2 V and 6 V, in both directions: it is assumed there and mirrored.
# 2. The friction along the guide: it decides between hundreds and thousands of readings a second.
# 3. The time from a reading to its force: it sets the limit of the loop.
# 4. The moved mass: the times of the stage scale with it.
# 5. The admittance around 215 kHz, pressed and warm: `Q`, `C_0` and the drift at once.
