"""Any model of the language as a plant of the virtual bench."""

from hardware.virtual.model_plant import ModelPlant as ModelPlant
