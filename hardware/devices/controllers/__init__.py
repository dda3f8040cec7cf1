"""Digital piezo controllers: GCS (PI) by our own client or PIPython, and ASCII dialects."""

from hardware.devices.controllers.ascii_controller import AsciiController
from hardware.devices.controllers.ascii_dialect import AsciiDialect
from hardware.devices.controllers.ascii_dialects import ASCII_DIALECTS, D_DRIVE, MDT69X, NV200
from hardware.devices.controllers.gcs_controller import GcsController
from hardware.devices.controllers.gcs_errors import device_error
from hardware.devices.controllers.gcs_recorder import GcsRecorder
from hardware.devices.controllers.gcs_setup import GcsSetup
from hardware.devices.controllers.gcs_talk import GcsTalk, OwnGcsTalk
from hardware.devices.controllers.gcs_wave import GcsWave
from hardware.devices.controllers.pipython_talk import PIPythonTalk

__all__ = [
    "ASCII_DIALECTS",
    "D_DRIVE",
    "MDT69X",
    "NV200",
    "AsciiController",
    "AsciiDialect",
    "GcsController",
    "GcsRecorder",
    "GcsSetup",
    "GcsTalk",
    "GcsWave",
    "OwnGcsTalk",
    "PIPythonTalk",
    "device_error",
]
