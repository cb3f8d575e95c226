"""The outside autopilots that can fly here: how each is reached, what it is told of the vehicle, who speaks its way."""

import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.transport.client_links import open_client_link
from autopilot.mavlink.transport.links import LOOPBACK, OFFBOARD_PORT, Link, LinkRole, UdpLink, bound_socket
from common.airframe import Airframe
from mission.boards.ardupilot_drone import ArduPilotDrone
from mission.boards.outside_drone import OutsideDrone
from mission.boards.px4_drone import Px4Drone
from mission.boards.px4_params import px4_environment, px4_model
from mission.boards.vehicle_params import ardupilot_params, check_id_free, value_text
from mission.flight_config import FlightConfig
from sim.boards.ardupilot import PORT as JSON_PORT
from sim.boards.ardupilot import ArduPilotBoard
from sim.boards.channels import control_channels, pulse_channels
from sim.boards.outside import OnWait
from sim.boards.px4 import PORT as HIL_PORT
from sim.boards.px4 import Px4Board
from sim.bodies.vehicles import class_of
from sim.rig import Rig

OutsideBoard = ArduPilotBoard | Px4Board
MakeBoard = Callable[[Rig, Airframe, FlightConfig, int, OnWait], OutsideBoard]

_ARDUPILOT_TCP, _ARDUPILOT_STEP = 5760, 10
_PX4_PAYLOAD, _PX4_PAYLOAD_OWN = 14030, 14280  # its third link, slow, for what is on board
_PX4_OFFBOARD_OWN = 14580
_PX4_OFFBOARD_LAST = 9  # further instances speak to the port of this one


@dataclass(frozen=True, slots=True)
class Peer:
    """One kind of autopilot."""

    name: str
    dialect: Dialect
    drone: type[OutsideDrone]
    """Who speaks its way."""
    make_board: MakeBoard
    """From the rig, its airframe, the flight's configuration, the number of the instance, and what is done while it is
    silent."""
    protocol: str
    """Of the exchange: UDP or TCP."""
    port: int
    """Of the exchange with the first instance; the next ones are `port_step` further each."""
    port_step: int
    open_link: Callable[[int], Link]
    """To the MAVLink port of an instance that is the flight's own."""
    open_companion_link: Callable[[int], Link]
    """To the one that a companion is fed by; where it is the same, the companion is joined with the flight."""
    has_station_ports: bool
    """It speaks to ground stations itself, where they listen; else we link them through."""
    prepare: Callable[[FlightConfig, Airframe, Path, int], Mapping[str, str]]
    """Writes what an instance is told of the vehicle into a folder; returns what is added to its environment."""
    model: Callable[[Airframe], str]
    """What it is told to be where it is started."""
    waits_for: str
    """What it has to do to be heard; `{port}` is where, `{model}` what it is told to be."""

    def check_ports(self, instance: int) -> None:
        """Refuses ports that are taken, while nothing is built yet.

        Raises:
            LinkError: of one that is.
        """
        kind = socket.SOCK_STREAM if self.protocol == "TCP" else socket.SOCK_DGRAM
        bound_socket(kind, LOOPBACK, self.port_of(instance)).close()
        self.open_link(instance).close()

    def port_of(self, instance: int) -> int:
        """Where an instance exchanges sensors and actuators with us."""
        return self.port + self.port_step * instance


def _ardupilot_board(
    rig: Rig, airframe: Airframe, config: FlightConfig, instance: int, on_wait: OnWait
) -> ArduPilotBoard:
    channels, port = pulse_channels(class_of(airframe).vehicle, airframe), JSON_PORT + _ARDUPILOT_STEP * instance
    return ArduPilotBoard(
        rig, channels=channels, home=config.home, on_wait=on_wait, port=port, start_ne_m=config.start_ne_m
    )


def _px4_board(rig: Rig, airframe: Airframe, config: FlightConfig, instance: int, on_wait: OnWait) -> Px4Board:
    channels = control_channels(class_of(airframe).vehicle, airframe)
    return Px4Board(rig, channels=channels, home=config.home, on_wait=on_wait, port=HIL_PORT + instance)


def _ardupilot_link(instance: int) -> Link:
    return open_client_link(f"tcp://127.0.0.1:{_ARDUPILOT_TCP + _ARDUPILOT_STEP * instance}", LinkRole.ONBOARD)


def _px4_link(instance: int) -> Link:
    return UdpLink(_PX4_PAYLOAD_OWN + instance, LinkRole.ONBOARD, local_port=_PX4_PAYLOAD + instance)


def _px4_offboard_link(instance: int) -> Link:
    local_port = OFFBOARD_PORT + min(instance, _PX4_OFFBOARD_LAST)
    return UdpLink(_PX4_OFFBOARD_OWN + instance, LinkRole.ONBOARD, local_port=local_port)


def _prepare_ardupilot(config: FlightConfig, airframe: Airframe, folder: Path, instance: int) -> Mapping[str, str]:
    check_id_free(config.parameters)
    numbers = dict.fromkeys(("MAV_SYSID", "SYSID_THISMAV"), instance + 1.0)  # as it is called since 4.7, and before
    values = numbers | ardupilot_params(airframe) | config.parameters
    text = "".join(f"{name} {value_text(value)}\n" for name, value in values.items())
    (folder / "vehicle.parm").write_text(text)
    return {}


def _prepare_px4(config: FlightConfig, airframe: Airframe, _: Path, __: int) -> Mapping[str, str]:
    return px4_environment(airframe, config.parameters)


PEERS: Mapping[str, Peer] = {
    "ardupilot": Peer(
        name="ArduPilot",
        dialect=ARDUPILOT,
        drone=ArduPilotDrone,
        make_board=_ardupilot_board,
        protocol="UDP",
        port=JSON_PORT,
        port_step=_ARDUPILOT_STEP,
        open_link=_ardupilot_link,
        open_companion_link=_ardupilot_link,
        has_station_ports=False,
        prepare=_prepare_ardupilot,
        model=lambda _: "JSON",
        waits_for="start it with --model {model}; its servos are expected at UDP port {port}",
    ),
    "px4": Peer(
        name="PX4",
        dialect=PX4,
        drone=Px4Drone,
        make_board=_px4_board,
        protocol="TCP",
        port=HIL_PORT,
        port_step=1,
        open_link=_px4_link,
        open_companion_link=_px4_offboard_link,
        has_station_ports=True,
        prepare=_prepare_px4,
        model=px4_model,
        waits_for="start it with PX4_SIM_MODEL={model}; it is expected at TCP port {port}",
    ),
}
