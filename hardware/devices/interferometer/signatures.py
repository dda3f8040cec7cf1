"""Types of the functions of `siosifm`: name, result, arguments."""

from __future__ import annotations

import ctypes
import sys
from typing import Any, Final

_I, _U, _D = ctypes.c_int32, ctypes.c_uint32, ctypes.c_double
_TEXT = ctypes.c_char_p
_PORT = _I if sys.platform == "win32" else _TEXT

_BY_RESULT: tuple[tuple[Any, dict[str, tuple[Any, ...]]], ...] = (
    (
        _I,
        {
            "IfmDLLVersion": (),
            "IfmInit": (),
            "IfmGetError": (),
            "IfmSearchUSBDevices": (),
            "IfmUSBDeviceCount": (),
            "IfmUSBDeviceSerial": (_I,),
            "IfmOpenUSB": (_I,),
            "IfmSetBaudrate": (_I,),
            "IfmOpenCOM": (_PORT,),
            "IfmOpenNetwork": (_TEXT, _I),
            "IfmOpenDemo": (_I,),
            "IfmDeviceCount": (),
            "IfmDeviceValid": (_I,),
            "IfmFirmwareVersion": (_I,),
            "IfmChannels": (_I,),
            "IfmDeviceType": (_I,),
            "IfmDeviceInterface": (_I,),
            "IfmHasDeviceProperty": (_I, _I),
            "IfmSetDeviceInfo": (_I, _I, _I),
            "IfmSetTrigger": (_I, _U),
            "IfmFireTrigger": (_I,),
            "IfmSetFilter": (_I, _U, _I, _I),
            "IfmSetFilterNotchFrequency": (_I, _I, _D),
            "IfmSetDeadPath": (_I, _I, _I),
            "IfmGetDeadPath": (_I, _I),
            "IfmSetPreset": (_I, _I, _D),
            "IfmSetToZero": (_I, _I),
            "IfmSetRefMirrorVibration": (_I, _I, _I),
            "IfmSetMeasurement": (_I, _U, _D),
            "IfmClearBuffers": (_I,),
            "IfmStart": (_I,),
            "IfmStop": (_I,),
            "IfmValueCount": (_I,),
            "IfmGetValues": (_I,),
            "IfmGetRecentValues": (_I, _I),
            "IfmAuxValue": (_I, _I, _I),
            "IfmSetBlockModeFilter": (_I, _U, _I, _I),
            "IfmSetBlockMode": (_I, _I, _I, _I),
            "IfmStartBlock": (_I, _I),
            "IfmIsBlockAvailable": (_I,),
            "IfmCancelBlock": (_I,),
            "IfmSignalQuality": (_I, _I, _I),
            "IfmNewSignalQualityAvailable": (_I,),
            "IfmWasBeamBreak": (_I, _I),
            "IfmWasLostValues": (_I,),
            "IfmWasLaserUnstable": (_I, _I),
            "IfmNewEnvValuesAvailable": (_I,),
            "IfmEnvSensorCount": (_I,),
            "IfmTemperatureFlags": (_I, _I),
            "IfmAirPressureFlags": (_I, _I),
            "IfmHumidityFlags": (_I, _I),
            "IfmEnvironmentFlags": (_I, _I),
            "IfmIsEdlenEnabled": (_I, _I),
        },
    ),
    (_U, {"IfmStatus": (_I, _I)}),
    (ctypes.c_int64, {"IfmRawValue": (_I, _I)}),
    (ctypes.c_ssize_t, {"IfmDeviceInfo": (_I, _I)}),
    (_TEXT, {"IfmGetErrorString": (_I,), "IfmDLLVersionString": ()}),
    (
        _D,
        {
            "IfmLengthValue": (_I, _I),
            "IfmGetPreset": (_I, _I),
            "IfmTemperature": (_I, _I),
            "IfmAirPressure": (_I, _I),
            "IfmHumidity": (_I, _I),
            "IfmWaterVapourPressure": (_I, _I),
            "IfmAirRefraction": (_I, _I),
            "IfmWavelength": (_I, _I),
            "IfmVacuumWavelength": (_I, _I),
            "IfmConversionCoeff": (_I, _I),
            "IfmDeadpathCoeff": (_I, _I),
            "IfmCalculateWavelength": (_D, _D, _D, _D),
        },
    ),
    (
        None,
        {
            "IfmSetOption": (_I, _I),
            "IfmClose": (),
            "IfmCloseDevice": (_I,),
            "IfmEnableEdlenCorrection": (_I, _I, _I),
            "IfmSetTemperature": (_I, _I, _D),
            "IfmSetAirPressure": (_I, _I, _D),
            "IfmSetHumidity": (_I, _I, _D),
            "IfmResetManualEnvironment": (_I, _I, _I),
        },
    ),
)

SIGNATURES: Final[dict[str, tuple[Any, tuple[Any, ...]]]] = {
    name: (result, arguments)
    for result, functions in _BY_RESULT
    for name, arguments in functions.items()
}
"""Result and arguments by name; lengths are in nm, dead paths in mm, air in degC, Pa, %."""
