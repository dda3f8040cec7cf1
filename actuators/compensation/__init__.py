"""Hysteresis compensation of a piezo stack: references, inverses, closed loop, tracking numbers."""

from __future__ import annotations

from actuators.compensation.closed_loop import ControlLoop as ControlLoop
from actuators.compensation.closed_loop import LoopRun as LoopRun
from actuators.compensation.closed_loop import run_loop as run_loop
from actuators.compensation.exactness import bond_graph_residual as bond_graph_residual
from actuators.compensation.exactness import lumped_residual as lumped_residual
from actuators.compensation.exactness import operator_residual as operator_residual
from actuators.compensation.exactness import voltage_steps as voltage_steps
from actuators.compensation.feedforward import Invertible as Invertible
from actuators.compensation.feedforward import LimitedFeedforward as LimitedFeedforward
from actuators.compensation.feedforward import feedforward as feedforward
from actuators.compensation.feedforward import limited_feedforward as limited_feedforward
from actuators.compensation.feedforward import linear_operator as linear_operator
from actuators.compensation.margins import OPEN as OPEN
from actuators.compensation.margins import Margins as Margins
from actuators.compensation.margins import ProportionalIntegral as ProportionalIntegral
from actuators.compensation.margins import SampledPlant as SampledPlant
from actuators.compensation.margins import choose_gains as choose_gains
from actuators.compensation.margins import margins as margins
from actuators.compensation.margins import pole_radius as pole_radius
from actuators.compensation.model_inverse import BondGraphStack as BondGraphStack
from actuators.compensation.model_inverse import LumpedStack as LumpedStack
from actuators.compensation.model_inverse import bond_graph_feedforward as bond_graph_feedforward
from actuators.compensation.model_inverse import field_law as field_law
from actuators.compensation.model_inverse import lumped_feedforward as lumped_feedforward
from actuators.compensation.motion import AnalyticMotion as AnalyticMotion
from actuators.compensation.reference import acceleration_jumps as acceleration_jumps
from actuators.compensation.reference import smooth_reference as smooth_reference
from actuators.compensation.reference import thesis_reference as thesis_reference
from actuators.compensation.scenarios import actuator_like as actuator_like
from actuators.compensation.scenarios import deviating as deviating
from actuators.compensation.scenarios import model_voltages as model_voltages
from actuators.compensation.scenarios import stack_of as stack_of
from actuators.compensation.scenarios import strategies as strategies
from actuators.compensation.tracking import Tracking as Tracking
from actuators.compensation.tracking import loop_thickness as loop_thickness
from actuators.compensation.tracking import tracking as tracking
from actuators.compensation.virtual_actuator import VirtualActuator as VirtualActuator
from actuators.stack.voltage_limits import P840_1 as P840_1
from actuators.stack.voltage_limits import UNIPOLAR as UNIPOLAR
from bondgraph.signals.drive_limits import DriveLimits as DriveLimits
from bondgraph.signals.drive_limits import VoltageLimit as VoltageLimit
