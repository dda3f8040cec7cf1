"""Functional mock-up units: FMI 2.0 for co-simulation, FMI 3.0 for model exchange."""

from bondgraph.export.fmu.build import fmu2_cosimulation as fmu2_cosimulation
from bondgraph.export.fmu.build import fmu3_model_exchange as fmu3_model_exchange
