"""How a flight is reached from outside: its ports, the key of its signatures, its live picture, its live page."""

from contextlib import ExitStack
from importlib.util import find_spec
from typing import TYPE_CHECKING

from autopilot.mavlink.transport.links import GIVE_WAY_US, LinkError, LinkRole, LinkSource
from autopilot.mavlink.transport.tcp_port import TcpPort
from autopilot.mavlink.transport.udp_port import SILENCE_US, UdpPort, address_towards
from autopilot.mavlink.wire.signing import FileStore, MemoryStore, SigningConfig
from common.clock import wall_unix_us
from common.state_folder import StateFolder
from mission.console.option_checks import UserError
from mission.flight_settings import FlightOptions
from mission.follow.image_server import ImageServer
from mission.video.mjpeg_server import StreamServer
from mission.video.rtp_video import PORT, RtpVideo, VideoError

if TYPE_CHECKING:
    from mission.foxglove.outputs import FoxgloveOutputs
    from mission.view.page import PageServer

GROUND_PORT_STEP = 18570 - 14550  # from a client's port to the vehicle's own: PX4's where the client's is PX4's
API_PORT_STEP = 14580 - 14540
TCP_PORT_STEP = 10  # ArduPilot's, from one vehicle to the next; PX4's UDP ports are one apart
API_PORTS = 10  # vehicles beyond share the last one, as PX4's do
PORT_MAX = 65535


def open_links(options: FlightOptions, speed: float, i_vehicle: int = 0) -> list[LinkSource]:
    """The ports of a vehicle: of several, all send to one ground station's, and each to an API port of its own."""
    _check_ports(options, i_vehicle)
    links: list[LinkSource] = []
    pace = max(speed, 1.0)  # clients' heartbeats follow the wall clock
    silence_us, give_way_us = int(SILENCE_US * pace), int(GIVE_WAY_US * pace)
    try:
        bind = options.bind or address_towards(options.host)
        for role, port, local_port in (
            (LinkRole.GROUND, options.gcs_port, options.gcs_port + GROUND_PORT_STEP + i_vehicle),
            (LinkRole.ONBOARD, api_port_of(options, i_vehicle), options.api_port + API_PORT_STEP + i_vehicle),
        ):
            links.append(
                UdpPort(
                    port, role, options.host,
                    local_port=local_port, bind=bind, silence_us=silence_us, give_way_us=give_way_us,
                )
            )  # fmt: skip
        if options.tcp_port is not None:
            links.append(TcpPort(options.tcp_port + TCP_PORT_STEP * i_vehicle, bind=bind, give_way_us=give_way_us))
    except LinkError as error:
        for link in links:
            link.close()
        options_of = {"UDP": "--gcs-port or --api-port", "TCP": "--tcp-port"}
        name = next((name for name in options_of if f"{name} port" in str(error) and " is in use " in str(error)), "")
        hint = f"; another flight may be running: choose {options_of[name]}" if name else ""
        raise UserError(f"{str(error).rstrip('.')}{hint}") from error
    return links


def api_port_of(options: FlightOptions, i_vehicle: int) -> int:
    """Where a vehicle's API client listens."""
    return options.api_port + min(i_vehicle, API_PORTS - 1)


def _check_ports(options: FlightOptions, i_vehicle: int) -> None:
    """The clients' two ports and the vehicle's own two must exist and be four."""
    gcs_port, api_port, nth = options.gcs_port, options.api_port, f" {i_vehicle + 1}" if i_vehicle else ""
    for name, port, step in (("gcs", gcs_port, GROUND_PORT_STEP), ("api", api_port, API_PORT_STEP)):
        if port + step + i_vehicle > PORT_MAX:
            raise UserError(
                f"--{name}-port {port}: must be at most {PORT_MAX - step - i_vehicle}: "
                f"the vehicle's own is {step + i_vehicle} above"
            )
    tcp_port = 0 if options.tcp_port is None else options.tcp_port + TCP_PORT_STEP * i_vehicle
    if tcp_port > PORT_MAX:
        raise UserError(
            f"--tcp-port {options.tcp_port}: must be at most {PORT_MAX - TCP_PORT_STEP * i_vehicle}: "
            f"that of vehicle{nth} is {TCP_PORT_STEP * i_vehicle} above"
        )
    own = (gcs_port + GROUND_PORT_STEP + i_vehicle, api_port + API_PORT_STEP + i_vehicle)
    if len({gcs_port, api_port_of(options, i_vehicle), *own}) < 4:
        raise UserError(
            f"--gcs-port {gcs_port} and --api-port {api_port}: must differ, also from vehicle{nth}'s own "
            f"ports {own[0]} and {own[1]}"
        )


def signing_config(options: FlightOptions, speed: float | None, state: StateFolder | None) -> SigningConfig | None:
    """Signatures follow the wall clock of the other end; in lockstep there is none, and the date is simulated."""
    if speed is None:
        return None
    store = MemoryStore() if state is None else FileStore(state.folder / "signing.json")
    try:
        store.load()
    except ValueError as error:  # without its key the vehicle would obey anybody
        raise UserError(f"{error}; remove it to fly without signing") from error
    return SigningConfig(store, wall_unix_us, options.has_to_sign)


def open_stream(port: int) -> StreamServer | None:
    """The camera's live picture, if it is asked for."""
    if port == 0:
        return None
    try:
        return StreamServer(port)
    except OSError as error:
        raise UserError(f"--stream-port {port}: {error.strerror}") from error


def open_video(port: int | None, host: str, *, may_wait: bool) -> RtpVideo | None:
    """The camera's video for ground stations.

    Args:
        port: where it is sent from the start; None: to the usual one, once a client starts it; 0: nowhere.
        host: the address it is sent to.
        may_wait: whether it may wait for a client.
    """
    if port == 0 or (port is None and not may_wait):
        return None
    try:
        return RtpVideo(host, port or PORT, is_running=port is not None)
    except VideoError as error:
        if port is None:
            return None
        raise UserError(f"--video-port {port}: {error}") from error


def open_images(options: FlightOptions) -> ImageServer | None:
    """The onboard camera's pictures for a companion computer, if somebody is to be followed."""
    if options.owner is None:
        return None
    try:
        return ImageServer(options.image_port)
    except LinkError as error:
        raise UserError(f"--image-port {options.image_port}: {error}") from error


def open_foxglove(options: FlightOptions, held: ExitStack) -> "FoxgloveOutputs | None":
    """What shows the flight in Foxglove, if that is asked for; it is closed with what is held until the end."""
    if not (options.has_mcap or options.has_foxglove):
        return None
    flag = "--mcap" if options.has_mcap else "--foxglove"
    if find_spec("foxglove") is None:
        raise UserError(f"{flag}: comes with the extra 'foxglove' (docs/start/installing.md)")
    from mission.foxglove.outputs import FoxgloveOutputs

    port = options.foxglove_port if options.has_foxglove else None
    try:
        outputs = FoxgloveOutputs(has_file=options.has_mcap, port=port)
    except OSError as error:
        raise UserError(f"--foxglove-port {port}: {error.strerror}") from error
    held.callback(outputs.close)
    return outputs


def open_page(port: int) -> "PageServer":
    """The server of the live page; it opens its port before the flight begins."""
    try:
        from mission.view.page import PageServer

        return PageServer(port, "Honeyguide")
    except ImportError as error:
        raise UserError(
            f"--view: {error.name} is missing; it comes with the extra 'viewer' (docs/start/installing.md)"
        ) from error
    except OSError as error:
        raise UserError(f"--view-port {port}: {error.strerror}") from error
