"""Digital piezo controllers: GCS (PI), and ASCII dialects."""

from hardware.devices.controllers.ascii_controller import AsciiController as AsciiController
from hardware.devices.controllers.ascii_dialect import AsciiDialect as AsciiDialect
from hardware.devices.controllers.ascii_dialects import ASCII_DIALECTS as ASCII_DIALECTS
from hardware.devices.controllers.ascii_dialects import D_DRIVE as D_DRIVE
from hardware.devices.controllers.ascii_dialects import MDT69X as MDT69X
from hardware.devices.controllers.ascii_dialects import NV200 as NV200
from hardware.devices.controllers.gateway_transport import GatewayTransport as GatewayTransport
from hardware.devices.controllers.gcs_controller import GcsController as GcsController
from hardware.devices.controllers.gcs_errors import device_error as device_error
from hardware.devices.controllers.gcs_recorder import GcsRecorder as GcsRecorder
from hardware.devices.controllers.gcs_setup import GcsSetup as GcsSetup
from hardware.devices.controllers.gcs_talk import GcsTalk as GcsTalk
from hardware.devices.controllers.gcs_wave import GcsWave as GcsWave
