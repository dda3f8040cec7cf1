"""Force gauges."""

from hardware.devices.gauge.averaging import Averaged as Averaged
from hardware.devices.gauge.averaging import averaged as averaged
from hardware.devices.gauge.averaging import plateaus as plateaus
from hardware.devices.gauge.force_gauge import ForceGauge as ForceGauge
