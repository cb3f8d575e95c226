"""Devices on board: servos, relays and gripper; tunes for the buzzer; corrections for the GNSS receiver.

In: commands and messages. Out: what `vehicle.payload` is told, and the texts that say what happened.
"""

from collections.abc import Mapping
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import Reply, Severity
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Command, CommandHandler, Handler, Service
from autopilot.mavlink.wire.rtcm import RtcmAssembler
from autopilot.mavlink.wire.tune import TuneError, tune_length_s

QBASIC = 1  # TUNE_FORMAT


class DeviceService(Service):
    """Passes commands on to what the vehicle carries."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._rtcm = RtcmAssembler()

    def messages(self) -> Mapping[str, Handler]:
        return {
            "PLAY_TUNE": self.tune_received,
            "PLAY_TUNE_V2": self.tune_v2_received,
            "GPS_RTCM_DATA": self.rtcm_received,
        }

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            mavlink.MAV_CMD_DO_SET_RELAY: self._relay,
            mavlink.MAV_CMD_DO_SET_SERVO: self._servo,
            mavlink.MAV_CMD_DO_REPEAT_RELAY: self._repeat_relay,
            mavlink.MAV_CMD_DO_REPEAT_SERVO: self._repeat_servo,
            mavlink.MAV_CMD_DO_SET_ACTUATOR: self._actuator,
            mavlink.MAV_CMD_DO_GRIPPER: self._gripper,
        }

    def _relay(self, command: Command) -> Reply:
        """Switches a relay.

        Params: p1 relay, from 0; p2 1 on, 0 off.
        Refused: DENIED for a relay or a value there is not.
        """
        return self._run(command)

    def _servo(self, command: Command) -> Reply:
        """Sets the pulse of an auxiliary output.

        Params: p1 output, 9 to 16; p2 pulse [us], 500 to 2500.
        Refused: DENIED for an output that is a motor's or not there, and for a pulse out of range.
        """
        return self._run(command)

    def _repeat_relay(self, command: Command) -> Reply:
        """Switches a relay to and fro.

        Params: p1 relay, from 0; p2 how often; p3 period [s].
        Refused: DENIED for a relay there is not, and for a number or period out of range.
        """
        return self._run(command)

    def _repeat_servo(self, command: Command) -> Reply:
        """Moves an auxiliary output to a pulse and back to the middle, several times.

        Params: p1 output, 9 to 16; p2 pulse [us], 500 to 2500; p3 how often; p4 period [s].
        Refused: DENIED for an output that is a motor's or not there, and for a pulse, number or period out of range.
        """
        return self._run(command)

    def _actuator(self, command: Command) -> Reply:
        """Sets auxiliary outputs 9 to 14 as actuators 1 to 6.

        Params: p1 to p6 values from -1 to 1, NaN: as it is; p7 group, only 0.
        Refused: DENIED for a value or a group out of range.
        """
        return self._run(command)

    def _gripper(self, command: Command) -> Reply:
        """Grabs or releases.

        Params: p1 gripper, 0 or 1; p2 0 releases, 1 grabs.
        Refused: DENIED for another gripper or action; UNSUPPORTED where there is no gripper.
        """
        return self._run(command)

    def _run(self, command: Command) -> Reply:
        params = (command.p1, command.p2, command.p3, command.p4)
        return self._endpoint.vehicle.payload.run(command.command, params, command.x, command.y, command.z)

    # Buzzer

    def tune_received(self, _: Sender, fields: Any) -> None:
        """Plays a tune in the QBASIC format."""
        self._play(QBASIC, fields.tune + fields.tune2)

    def tune_v2_received(self, _: Sender, fields: Any) -> None:
        """Plays a tune in the QBASIC format; another format is refused with a text."""
        self._play(fields.format, fields.tune)

    def _play(self, tune_format: int, tune: str) -> None:
        if tune_format != QBASIC:
            self._endpoint.text_once(Severity.WARNING, f"Tune: format {tune_format} is not supported, only QBASIC")
            return
        try:
            notes, length_s = tune_length_s(tune)
        except TuneError as error:
            self._endpoint.text_once(Severity.WARNING, f"Tune: {error}")
            return
        self._endpoint.text(Severity.INFO, f"Tune: {notes} notes, {length_s:.1f} s")

    # Receiver

    def rtcm_received(self, _: Sender, fields: Any) -> None:
        """Puts fragments of RTCM 3 corrections together and gives them to the GNSS receiver."""
        message = self._rtcm.add(fields.flags, bytes(fields.data[: fields.len]))
        if message is not None:
            self._endpoint.vehicle.give_corrections(message)
