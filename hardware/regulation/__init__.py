"""Feedback on a bench: one loop over the guard, the journal and the clock that takes use."""

from hardware.regulation.controller import Controller as Controller
from hardware.regulation.inverse_loop import InverseLoop as InverseLoop
from hardware.regulation.open_loop import OpenLoop as OpenLoop
from hardware.regulation.plan import LoopPlan as LoopPlan
from hardware.regulation.recording import Regulated as Regulated
from hardware.regulation.recording import record_loop as record_loop
from hardware.regulation.running import LOOP as LOOP
from hardware.regulation.running import check_rate as check_rate
from hardware.regulation.running import regulate as regulate
from hardware.regulation.station import LoopStation as LoopStation
from hardware.regulation.timing import CycleCost as CycleCost
from hardware.regulation.timing import LoopTiming as LoopTiming
