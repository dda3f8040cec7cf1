"""A guarded voltage as a Bluesky motor; satisfies the protocols without importing Bluesky."""

from __future__ import annotations

from typing import Any, final

from hardware.contracts import Clock, WallClock
from hardware.ecosystem.documents import number_key, or_nan, readings, source_of
from hardware.ecosystem.status import ActionStatus
from hardware.envelope import GuardedOutput, OutputState, check_ramp


@final
class BlueskyVoltage:
    """Movable, Locatable, Checkable, Readable, Stageable, Pausable and Stoppable.

    Every move is a ramp. Staging powers the output up if it is unknown; unstaging, a pause and a
    stop of the run park it. After a pause the plan goes back to its last checkpoint and moves
    again.

    Parameters
    ----------
    output : GuardedOutput
        The only way to the actuator.
    name : str
        Of the field in the events.
    rate : float, optional
        Of the ramps (V/s); by default the envelope's gentle one.
    readback : bool
        Whether a second field holds what the device measures.
    settle : float
        Time from the end of a ramp until the move counts as done (s): what is read right behind
        the last step still sees the actuator on its way.
    clock : Clock, optional
        Time of the program, in which it settles.
    """

    parent: None = None

    def __init__(
        self,
        output: GuardedOutput,
        name: str = "voltage",
        *,
        rate: float | None = None,
        readback: bool = False,
        settle: float = 0.01,
        clock: Clock | None = None,
    ) -> None:
        self._output = output
        self.name = name
        self._rate = rate
        self._readback = readback
        self._settle = settle
        self._clock: Clock = WallClock() if clock is None else clock
        self._setpoint: float | None = None
        self._move = ActionStatus.finished(f"{name} at rest")

    @property
    def hints(self) -> dict[str, Any]:
        """What to plot."""
        return {"fields": [self.name]}

    @property
    def position(self) -> float:
        """Voltage last commanded (V); NaN while unknown."""
        return or_nan(self._output.present)

    def check_value(self, value: float) -> None:
        """Refuse a voltage (V) that no ramp from the safe value may reach; nothing is sent.

        Raises
        ------
        LimitViolation
            Which limit.
        """
        envelope = self._output.envelope
        check_ramp(envelope, envelope.safe, value, self._rate, converter=self._output.converter)

    def set(self, value: float) -> ActionStatus:
        """Ramp to a voltage (V); refused at once if it is outside of the envelope."""
        self.check_value(value)
        self._setpoint = float(value)
        self._move = ActionStatus.run(f"{self.name} to {value:g} V", lambda: self._go(value))
        return self._move

    def _go(self, value: float) -> None:
        self._output.ramp(value, self._rate)
        self._clock.sleep(self._settle)

    def locate(self) -> dict[str, float]:
        """Return where it should be and where it is (V)."""
        target = self.position if self._setpoint is None else self._setpoint
        return {"setpoint": target, "readback": self.position}

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the voltage last commanded (V), and the measured one if asked for."""
        values = {self.name: self.position}
        if self._readback:
            values[f"{self.name}_readback"] = or_nan(self._output.read())
        return readings(values)

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return units and source of the fields."""
        source = source_of(self._output.identity)
        envelope = self._output.envelope
        key = number_key(source, "V")
        key["limits"] = {"control": {"low": envelope.v_min, "high": envelope.v_max}}
        keys = {self.name: key}
        if self._readback:
            keys[f"{self.name}_readback"] = number_key(source, "V")
        return keys

    def read_configuration(self) -> dict[str, dict[str, Any]]:
        """Return limits and watchdog."""
        envelope, rate = self._output.envelope, self._rate
        return readings(
            {
                f"{self.name}_envelope": envelope.describe(),
                f"{self.name}_ramp_rate": envelope.ramp_rate if rate is None else rate,
                f"{self.name}_has_watchdog": self._output.status.has_watchdog,
            }
        )

    def describe_configuration(self) -> dict[str, dict[str, Any]]:
        """Return the keys of `read_configuration`."""
        source = source_of(self._output.identity)
        return {
            f"{self.name}_envelope": {"source": source, "dtype": "string", "shape": []},
            f"{self.name}_ramp_rate": number_key(source, "V/s"),
            f"{self.name}_has_watchdog": {"source": source, "dtype": "boolean", "shape": []},
        }

    def stage(self) -> ActionStatus:
        """Power the output up if nobody knows its voltage.

        It is at rest when this returns, so that a sensor staged behind it takes its zero there; a
        pause that an engine is asked for meanwhile takes effect behind it.
        """
        if self._output.state is OutputState.UNKNOWN:
            return ActionStatus.at_once(f"power up {self.name}", self._begin)
        return ActionStatus.finished(f"stage {self.name}")

    def _begin(self) -> None:
        self._output.power_up()
        self._clock.sleep(self._settle)

    def unstage(self) -> ActionStatus:
        """Park."""
        return ActionStatus.run(f"park {self.name}", self._output.stop)

    def stop(self, success: bool = True) -> None:
        """Park, and wait for it: nothing in a run is more urgent.

        A move on its way ends: well if the engine stops as planned (a pause; it moves again
        afterwards), else with the error of its ramp.
        """
        if success:
            self._move.finish()
        self._output.stop()

    def pause(self) -> None:
        """Park while the run is paused."""
        self.stop()

    def resume(self) -> None:
        """Do nothing: the plan moves again from its last checkpoint."""
