"""A running flight on the channels of one sink: its states, its texts, its scene and its camera."""

from collections.abc import Sequence
from typing import Any

from foxglove import Context

from mission.flight_base import FlightBase
from mission.foxglove.camera import FlightCamera
from mission.foxglove.channels import MOVING, PLAN, VEHICLE_SHAPE, WORLD
from mission.foxglove.flight_state import FlightStates
from mission.foxglove.publisher import Publisher
from mission.foxglove.scene import MovingScene, plan_scene, vehicle_scene, world_scene

STATE_PERIOD_US = 40_000  # of the fastest channels


class FlightExport:
    """Tells one sink of a flight.

    Args:
        flight: which.
        context: of the sink.
        path_ned: [m] (n, 3) of its plan.
        has_camera_thread: images are rendered while the flight goes on.
    """

    def __init__(
        self, flight: FlightBase, context: Context, path_ned: Sequence[Any] = (), *, has_camera_thread: bool = False
    ) -> None:
        self._flight, self._path_ned = flight, path_ned
        self._states = FlightStates(flight)
        self._publisher = Publisher(context)
        self._camera = FlightCamera(flight, has_thread=has_camera_thread)
        self._moving = MovingScene(flight.world)
        self._text_count = 0

    def frame(self) -> None:
        """After each frame of the flight."""
        flight, publisher = self._flight, self._publisher
        if flight.time_us % STATE_PERIOD_US == 0:
            state = self._states.now()
            publisher.publish(state, self._camera.mount)
            if publisher.channels.is_due(MOVING, flight.time_us):
                update = self._moving.update(state)
                if update is not None:
                    publisher.channels.log(MOVING, update, flight.time_us)
        self._publish_scene()
        self._camera.frame(publisher.channels, flight.time_us)
        for text in flight.texts.since(self._text_count):
            publisher.text(text.time_us, text.severity, text.text, flight.time_us)
        self._text_count = flight.texts.count

    def heard(self, topic: str) -> None:
        """Somebody new listens to a channel: what is told once is told again."""
        self._publisher.channels.repeat(topic)

    def close(self) -> None:
        """Ends what runs beside the flight."""
        self._camera.close()

    def _publish_scene(self) -> None:
        """What is told once."""
        flight, channels, now_us = self._flight, self._publisher.channels, self._flight.time_us
        if channels.is_due(WORLD, now_us):
            channels.log(WORLD, world_scene(flight.world, now_us), now_us)
        if channels.is_due(VEHICLE_SHAPE, now_us):
            channels.log(VEHICLE_SHAPE, vehicle_scene(flight.airframe, now_us), now_us)
        if len(self._path_ned) and channels.is_due(PLAN, now_us):
            channels.log(PLAN, plan_scene(self._path_ned, now_us), now_us)
