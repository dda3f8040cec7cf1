"""Digital piezo controllers: GCS (PI), and ASCII dialects."""

from hardware.devices.controllers.ascii_controller import AsciiController
from hardware.devices.controllers.ascii_dialect import AsciiDialect
from hardware.devices.controllers.ascii_dialects import ASCII_DIALECTS, D_DRIVE, MDT69X, NV200
from hardware.devices.controllers.gateway_transport import GatewayTransport
from hardware.devices.controllers.gcs_controller import GcsController
from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.controllers.gcs_recorder import GcsRecorder
from hardware.devices.controllers.gcs_setup import GcsSetup
from hardware.devices.controllers.gcs_talk import GcsTalk
from hardware.devices.controllers.gcs_wave import GcsWave

__all__ = [
    "ASCII_DIALECTS",
    "D_DRIVE",
    "MDT69X",
    "NV200",
    "AsciiController",
    "AsciiDialect",
    "GatewayTransport",
    "GcsController",
    "GcsRecorder",
    "GcsSetup",
    "GcsTalk",
    "GcsWave",
    "device_error",
]
