"""What every flight is to those who run, show and judge it, whoever flies it: our flight controller or another's."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from math import isnan, nan
from typing import TYPE_CHECKING, Any, Protocol, Self

from autopilot.mavlink.transport.links import Link
from common.airframe import Airframe
from common.clock import Pacer
from common.kernels import FRAME_TICKS
from mission.client import Running
from mission.console.host_troubles import Troubles
from mission.console.status_texts import Texts
from mission.flight_config import FlightConfig, OwnerConfig
from mission.log.flight_recorder import History, Recorder
from mission.script import Drone, Script
from mission.simulator.failure_injection import RigInjector
from mission.simulator.flight_rig import GUST_FRACTION, flight_wind
from mission.simulator.simulator_params import TURBULENCE_FRACTION
from sim.hand import Hand
from sim.rig import Rig
from sim.world.world import WorldMap

if TYPE_CHECKING:
    from mission.follow.onboard_camera import OnboardCamera
    from mission.follow.owner_device import FollowedOwner


class Computer(Protocol):
    """A companion computer on board, in lockstep with the flight."""

    def frame(self, time_us: int) -> None: ...


class FlightBase(ABC):
    """A vehicle in its world, advanced frame by frame.

    Args:
        config: what it is made from.
        airframe: the vehicle.
    """

    config: FlightConfig
    airframe: Airframe
    world: WorldMap
    rig: Rig
    controller: Any
    """The flight controller: `state`, `modes`, `params` and `commander` as those of autopilot.flight_controller."""
    drives: bool
    drone: Drone
    """The flight's own scripting client."""
    recorder: Recorder
    injector: RigInjector
    hand: Hand | None
    """Who throws it; None: it is not thrown."""

    def __init__(self, config: FlightConfig, airframe: Airframe) -> None:
        self.config, self.airframe = config, airframe
        self.time_us = 0
        self.ready_s = nan  # power-on to ready to arm
        self.restart_count = 0
        self.end_reason = ""  # why it cannot go on
        self._pacer = Pacer(None)
        self.texts, self.troubles = Texts(lambda: self.time_us), Troubles(lambda: self.time_us)
        self.hand = None
        self.owner: FollowedOwner | None = None
        self.onboard: OnboardCamera | None = None
        self.computers: list[Computer] = []

    def frame(self) -> None:
        """Advances by 20 ms."""
        self.begin_frame()
        advance_together([self], range(FRAME_TICKS))
        self.end_frame()

    @abstractmethod
    def begin_frame(self) -> None:
        """What is done before the ticks of a frame."""

    @abstractmethod
    def advancing(self, ticks: range) -> Iterator[None]:
        """Advances by ticks of a frame, of which the first is 0; pauses where another program computes meanwhile."""

    @abstractmethod
    def end_frame(self) -> None:
        """What is done after the ticks of a frame."""

    @abstractmethod
    def restart(self) -> None:
        """Puts the vehicle back on its pad, whole and with a full battery."""

    @abstractmethod
    def close(self) -> History:
        """Completes the logs, closes the links and returns the history."""

    @property
    def is_crashed(self) -> bool:
        """The truth: it struck something too fast, or a turning blade struck the ground."""
        return bool(self.rig.rows["truth"]["is_crashed"][0])

    def run(
        self,
        is_over: Callable[[Self], bool],
        *,
        speed: float | None = None,
        on_frame: Callable[[Self], None] | None = None,
    ) -> None:
        """Advances until `is_over(self)`.

        Args:
            is_over: asked after each frame.
            speed: simulated seconds per second; None runs as fast as possible.
            on_frame: called after each frame, for progress displays.
        """
        self.change_speed(speed)
        while not (self.end_reason or is_over(self)):
            self._pacer.wait_until(self.time_us)
            self.frame()
            if on_frame is not None:
                on_frame(self)

    def _carry_camera(self, config: OwnerConfig) -> Link:
        """Brings the owner and the onboard camera in; the phone's link."""
        from mission.follow.onboard_camera import OnboardCamera  # what a policy sees is defined beside the policies
        from mission.follow.owner_device import FollowedOwner

        self.owner = FollowedOwner(config, self.world, self.rig.arrays.truth, self.config.seed, self.config.home)
        self.onboard = OnboardCamera(self.rig, self.world, self.owner.cast, self.config.noise, self.config.seed)
        return self.owner.vehicle_end

    def _note_ready(self) -> None:
        if isnan(self.ready_s) and self.controller.state.is_ready_to_arm:
            self.ready_s = self.time_us * 1e-6

    def change_speed(self, speed: float | None) -> None:
        """Simulated seconds per second from the next frame on, while it runs; None: as fast as possible."""
        self._pacer = Pacer(speed)
        self.recorder.is_live = speed is not None

    def set_wind(self, speed_m_s: float, from_deg: float) -> None:
        """From the next frame on the mean blows so, with turbulence and gusts to match."""
        self.set_air(speed_m_s, from_deg, TURBULENCE_FRACTION * speed_m_s)

    def set_air(self, speed_m_s: float, from_deg: float, turbulence_m_s: float) -> None:
        """From the next frame on the mean blows so; the vertical wind deviates so much, and gusts go with it."""
        air = flight_wind(speed_m_s, from_deg)
        air.turbulence_w_std = turbulence_m_s
        air.gust_m_s = GUST_FRACTION / TURBULENCE_FRACTION * turbulence_m_s
        self.rig.set_air(air)

    def fly(self, script: Script, *, seconds: float = 3600.0) -> Running:
        """Runs a script to its end in lockstep, for at most `seconds` of simulated time."""
        running = self.drone.start(script(self.drone))
        end_us = self.time_us + int(seconds * 1e6)
        self.run(lambda _: running.is_done or self.time_us >= end_us)
        running.cancel()
        return running


def advance_together(flights: Sequence[FlightBase], ticks: range) -> None:
    """Advances flights by the same ticks of a frame; while one waits for another program, the others go on."""
    under_way = [flight.advancing(ticks) for flight in flights]
    while under_way:
        under_way = [each for each in under_way if next(each, _OVER) is not _OVER]


_OVER = object()
