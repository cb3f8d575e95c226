"""Which channel of an outside autopilot moves which of our actuators, and how its numbers become ours."""

from collections.abc import Sequence
from typing import NamedTuple

from autopilot.interface.outputs import OutputKind
from autopilot.vehicles.vehicle_class import VehicleClass
from common.airframe import Airframe

_PULSE_LOW_US, _PULSE_NEUTRAL_US, _PULSE_HIGH_US = 1000.0, 1500.0, 2000.0


class Channel(NamedTuple):
    """One actuator's source; its command is (value - zero) / full."""

    number: int
    """Of the channel, from 0."""
    zero: float
    full: float


# ArduPilot's functions of a rover's and a plane's first four channels, as its defaults have them; the rest are told it
_ARDUPILOT_CHANNELS = {
    "steering": 0,
    "motor": 2,
    "left motors": 0,  # SERVO1_FUNCTION 73, throttle left
    "right motors": 2,  # SERVO3_FUNCTION 74, throttle right
    "ailerons": 0,
    "elevator": 1,
    "rudder": 3,
    "nose wheel": 3,  # turned by the rudder's servo: it steers by the rudder, too, if it has no channel for the wheel
    "brake": 4,  # SERVO5_FUNCTION 3, flaps: it has no brakes, and sets those at the approach
}


def pulse_channels(vehicle: VehicleClass, airframe: Airframe) -> list[Channel | None]:
    """ArduPilot's pulses [us] for each element of `Actuators.command`; None: nothing moves it.

    The motors of copters have its numbers for a frame in X, which are PX4's and those of our airframe files.

    Raises:
        ValueError: it has no channel for an actuator that the vehicle cannot do without.
    """
    outputs = vehicle.outputs(airframe)
    span = _PULSE_HIGH_US - _PULSE_LOW_US
    if all(output.kind is OutputKind.MOTOR and not output.is_signed for output in outputs):
        return [Channel(k, _PULSE_LOW_US, span) for k in range(len(outputs))]
    found: list[Channel | None] = []
    for output in outputs:
        index = _ARDUPILOT_CHANNELS.get(output.name)
        if index is None:
            if output.kind is OutputKind.MOTOR:
                raise ValueError(f"ArduPilot has no channel for '{output.name}' of {airframe.name}")
            found.append(None)
        elif output.is_signed:
            found.append(Channel(index, _PULSE_NEUTRAL_US, 0.5 * span))
        else:
            found.append(Channel(index, _PULSE_LOW_US, span))
    return found


def control_channels(vehicle: VehicleClass, airframe: Airframe) -> list[Channel | None]:
    """PX4's actuator controls, [0..1] of motors and [-1..1] of what is signed: output functions in our order.

    It has no brakes.
    """
    outputs = vehicle.outputs(airframe)
    return [None if output.name == "brake" else Channel(k, 0.0, 1.0) for k, output in enumerate(outputs)]


def commands_of(channels: Sequence[Channel | None], values: Sequence[float]) -> list[float]:
    """The commands [-1..1] of the actuators.

    Args:
        channels: where they come from.
        values: of the autopilot's channels; a pulse of 0 is none, and moves nothing.
    """
    commands = []
    for channel in channels:
        value = 0.0 if channel is None else values[channel.number]
        if channel is None or (value == 0.0 and channel.zero > 0.0):
            commands.append(0.0)
        else:
            commands.append(min(max((value - channel.zero) / channel.full, -1.0), 1.0))
    return commands
