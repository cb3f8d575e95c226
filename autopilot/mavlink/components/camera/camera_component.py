"""The camera component (id 100): the commands that stations send it, its information, and a report of each photo."""

from collections.abc import Mapping
from functools import partial

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Severity, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.components.camera.camera_messages import STREAM_ID, CameraMessages
from autopilot.mavlink.components.camera.camera_settings_protocol import SettingsService
from autopilot.mavlink.components.component import Component, Payload
from autopilot.mavlink.service import Command, CommandHandler, Handler, Service, denied
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import whole
from autopilot.payload.camera.camera import CAMERA_ID, Camera, Shot
from autopilot.payload.camera.camera_commands import CameraCommands
from autopilot.payload.camera.camera_commands import Command as CameraCommand

REPEAT_US = 3_000_000  # a single photo of the same number from the same client is a repeat that long; guess
_CAPTURE_STATUS = known_type("CAMERA_CAPTURE_STATUS")
_CAPTURE_STATUS_ID = _CAPTURE_STATUS.msg_id
_CAMERA_SETTINGS = known_type("CAMERA_SETTINGS")
_CAMERA_TRIGGER = known_type("CAMERA_TRIGGER")
_CAMERA_IMAGE_CAPTURED = known_type("CAMERA_IMAGE_CAPTURED")
_CAMERA_FEEDBACK = known_type("CAMERA_FEEDBACK")
_STREAM_STATUS = known_type("VIDEO_STREAM_STATUS")
_IMAGE_CAPTURED_ID = _CAMERA_IMAGE_CAPTURED.msg_id
# Requests older than REQUEST_MESSAGE, and what they ask for.
_OLD_REQUESTS = {
    mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: "CAMERA_INFORMATION",
    mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS: "CAMERA_SETTINGS",
    mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION: "STORAGE_INFORMATION",
    mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: "CAMERA_CAPTURE_STATUS",
    mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION: "VIDEO_STREAM_INFORMATION",
    mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS: "VIDEO_STREAM_STATUS",
}
# Which parameter names the camera: 0 all, 1 the first, or its component id.
_CAMERA_PARAMETER = {
    CameraCommand.TRIGGER_DISTANCE: 4,
    CameraCommand.TRIGGER_INTERVAL: 3,
    CameraCommand.SET_MODE: 1,
    CameraCommand.SET_ZOOM: 3,
    CameraCommand.SET_FOCUS: 3,
    CameraCommand.START_PHOTOS: 1,
    CameraCommand.STOP_PHOTOS: 1,
    CameraCommand.TRIGGER_CONTROL: 4,
    CameraCommand.START_VIDEO: 3,
    CameraCommand.STOP_VIDEO: 2,
}


class CameraComponent(Component):
    """One camera on the vehicle's links.

    Args:
        endpoint: the vehicle's links.
        camera: the camera.
    """

    def __init__(self, endpoint: Endpoint, camera: Camera) -> None:
        self._camera = camera
        self._camera_commands = CameraCommands(camera)
        self._stream = endpoint.vehicle.host.live_stream
        self._messages = CameraMessages(camera, endpoint.vehicle.state, endpoint.vehicle.host)
        self._settings = SettingsService(camera.settings, self.reply)
        self._single: dict[tuple[int, int], tuple[float, int]] = {}  # number and time of a client's last single photo
        super().__init__(endpoint, CAMERA_ID, mavlink.MAV_TYPE_CAMERA, "Camera")
        camera.on_shot(self._shot_taken)
        camera.on_full(self._video_stopped)

    def messages(self) -> Mapping[str, Handler]:
        return self._settings.messages()

    def payloads(self) -> Mapping[str, Payload]:
        messages = self._messages
        return {
            "CAMERA_INFORMATION": messages.information,
            "CAMERA_SETTINGS": messages.settings,
            "STORAGE_INFORMATION": messages.storage,
            "CAMERA_CAPTURE_STATUS": messages.capture_status,
            "CAMERA_FOV_STATUS": messages.fov_status,
            **self._stream_payloads(),
        }

    def _stream_payloads(self) -> Mapping[str, Payload]:
        stream, messages = self._stream, self._messages
        if stream is None:
            return {}
        return {
            "VIDEO_STREAM_INFORMATION": partial(messages.stream_information, stream),
            "VIDEO_STREAM_STATUS": partial(messages.stream_status, stream),
        }

    def default_interval_us(self, msg_id: int) -> int:
        return 1_000_000 if msg_id == _CAPTURE_STATUS_ID else 0

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            **{int(number): self.run for number in CameraCommand},
            **{number: partial(self._old_request, name) for number, name in _OLD_REQUESTS.items()},
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_photos,
            mavlink.MAV_CMD_VIDEO_START_CAPTURE: self._start_video,
            mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: self._stop_video,
            mavlink.MAV_CMD_SET_CAMERA_MODE: self._set_and_tell,
            mavlink.MAV_CMD_SET_CAMERA_ZOOM: self._set_and_tell,
            mavlink.MAV_CMD_SET_CAMERA_FOCUS: self._set_and_tell,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request,
            mavlink.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE: self._old_image_request,
            mavlink.MAV_CMD_RESET_CAMERA_SETTINGS: self._reset,
            mavlink.MAV_CMD_STORAGE_FORMAT: self._format,
            mavlink.MAV_CMD_VIDEO_START_STREAMING: self._start_stream,
            mavlink.MAV_CMD_VIDEO_STOP_STREAMING: self._stop_stream,
        }

    # Images

    def run(self, command: Command) -> Reply:
        """Has the camera carry a command out.

        Params: as MAVLink has them; the target camera is 0 (all), 1 or 100.
        Refused: DENIED: no such camera, or a parameter is out of range; TEMPORARILY_REJECTED: busy; FAILED: no storage,
        or it is full.
        """
        params = (command.p1, command.p2, command.p3, command.p4)
        i_target = _CAMERA_PARAMETER.get(CameraCommand(command.command))
        target = 0.0 if i_target is None else params[i_target - 1]
        if target == target and target not in (0.0, 1.0, float(CAMERA_ID)):
            return denied(f"there is no camera {target:g}")
        return self._camera_commands.run(command.command, params, command.x, command.y, command.z)

    def _start_photos(self, command: Command) -> Reply:
        """Takes one photo or a series.

        Params: p1 camera (0, 1 or 100); p2 interval [s]; p3 number, 0 until stopped; p4 number of a single photo, by
        which a repeat is known.
        Refused: TEMPORARILY_REJECTED: busy; FAILED: no storage, or it is full; DENIED: the interval is too short.
        """
        client, now_us = (command.sender.sysid, command.sender.compid), self.endpoint.time_us
        if command.p3 == 1.0 and command.p4 > 0.0:
            number, time_us = self._single.get(client, (0.0, -REPEAT_US))
            if number == command.p4 and now_us - time_us < REPEAT_US:
                return ACCEPTED
        reply = self.run(command)
        if reply.verdict is Verdict.ACCEPTED and command.p3 == 1.0:
            if len(self._single) > 100:
                self._single.clear()
            self._single[client] = (command.p4, now_us)
        return reply

    def _start_video(self, command: Command) -> Reply:
        """Starts recording to a file.

        Params: p1 stream (0 or 1); p2 rate of CAMERA_CAPTURE_STATUS [Hz], 0 none; p3 camera.
        Refused: TEMPORARILY_REJECTED: already recording; FAILED: no storage, or it is full.
        """
        if command.p1 == command.p1 and command.p1 not in (0.0, float(STREAM_ID)):
            return denied(f"there is no stream {command.p1:g}")
        reply = self.run(command)
        if reply.verdict is Verdict.ACCEPTED and 0.0 < command.p2 <= 50.0:
            self.set_interval(command.sender.channel, _CAPTURE_STATUS_ID, round(1e6 / command.p2))
        return reply

    def _stop_video(self, command: Command) -> Reply:
        """Completes the recording, if there is one.

        Params: p1 stream (0 or 1); p2 camera.
        """
        reply = self.run(command)
        if reply.verdict is Verdict.ACCEPTED:
            self.set_interval(command.sender.channel, _CAPTURE_STATUS_ID, 0)
        return reply

    def _set_and_tell(self, command: Command) -> Reply | None:
        """Sets mode, zoom or focus, and tells everyone.

        Params: mode: p2 CAMERA_MODE; zoom and focus: p1 type, p2 value.
        Refused: DENIED: no such mode or type, or the value is out of range.
        """
        reply = self.run(command)
        if reply.verdict is not Verdict.ACCEPTED:
            return reply
        self.ack(command, reply.verdict)
        self.broadcast(_CAMERA_SETTINGS, self._messages.settings())
        return None

    def _shot_taken(self, shot: Shot) -> None:
        self.broadcast(_CAMERA_IMAGE_CAPTURED, self._messages.image_captured(shot))
        self.endpoint.broadcast(_CAMERA_TRIGGER, _CAMERA_TRIGGER.pack(shot.time_us, shot.index))
        if self.endpoint.dialect.name == "ardupilot":  # what its clients draw photos from
            self.endpoint.broadcast(_CAMERA_FEEDBACK, self._messages.feedback(shot))

    def _video_stopped(self) -> None:
        self.endpoint.text(Severity.WARNING, "Camera: video stopped: the storage is full")
        self.broadcast(_CAPTURE_STATUS, self._messages.capture_status())

    # Information

    def _request(self, command: Command) -> Reply | None:
        """Sends one message of the camera; of a photo by its index.

        Params: p1 message id; p2 index of the photo, storage or stream.
        Refused: UNSUPPORTED: there is no such message; DENIED: no such photo, storage or stream.
        """
        if whole(command.p1, -1) == _IMAGE_CAPTURED_ID:
            return self._image_requested(command, whole(command.p2, -1))
        return self._request_message(command)

    def _concerns(self, command: Command) -> bool:
        if command.command == mavlink.MAV_CMD_REQUEST_MESSAGE and command.p1 == _IMAGE_CAPTURED_ID:
            return True
        return super()._concerns(command)

    def _old_image_request(self, command: Command) -> Reply | None:
        """Sends the report of a photo again.

        Params: p1 its index.
        Refused: DENIED: there is no such photo.
        """
        return self._image_requested(command, whole(command.p1, -1))

    def _image_requested(self, command: Command, index: int) -> Reply | None:
        shot = self._camera.shot(index)
        if shot is None:
            return denied(f"there is no photo {index}")
        self.ack(command, Verdict.ACCEPTED)
        self.reply(command.sender, _CAMERA_IMAGE_CAPTURED, self._messages.image_captured(shot))
        return None

    def _old_request(self, name: str, command: Command) -> Reply | None:
        """Sends the message that an older request asks for.

        Params: p1 1 for all but storage and stream, where it is the id, 0 all.
        Refused: UNSUPPORTED: there is no stream.
        """
        return self.send_requested(command, name)

    # The rest

    def _reset(self, _: Command) -> Reply:
        """Sets the camera's settings, lens and mode to what they were at first.

        Refused: TEMPORARILY_REJECTED: it is taking images.
        """
        return self._camera.reset()

    def _format(self, command: Command) -> Reply:
        """Removes all images from the storage.

        Params: p1 storage (1, or 0 all); p2 1 to confirm.
        Refused: DENIED: no such storage, or not confirmed; TEMPORARILY_REJECTED: it is taking images.
        """
        if command.p1 not in (0.0, 1.0):
            return denied(f"there is no storage {command.p1:g}")
        if command.p2 != 1.0:
            return denied("parameter 2 must be 1 to format the storage")
        return self._camera.format_storage()

    def _start_stream(self, command: Command) -> Reply | None:
        """Starts the live video, or goes on with it.

        Params: p1 stream (0 or 1).
        Refused: UNSUPPORTED: the vehicle was started without a stream; DENIED: no such stream.
        """
        return self._switch_stream(command, is_on=True)

    def _stop_stream(self, command: Command) -> Reply | None:
        """Pauses the live video.

        Params: p1 stream (0 or 1).
        Refused: UNSUPPORTED: the vehicle was started without a stream; DENIED: no such stream.
        """
        return self._switch_stream(command, is_on=False)

    def _switch_stream(self, command: Command, *, is_on: bool) -> Reply | None:
        """Switches it, and tells everyone."""
        if self._stream is None:
            return Reply(Verdict.UNSUPPORTED, "there is no live video; --video-port gives one")
        if command.p1 == command.p1 and command.p1 not in (0.0, float(STREAM_ID)):
            return denied(f"there is no stream {command.p1:g}")
        self._stream.is_running = is_on
        self.ack(command, Verdict.ACCEPTED)
        self.broadcast(_STREAM_STATUS, self._messages.stream_status(self._stream))
        return None


class AttachedCamera(Service):
    """The camera as the autopilot's own: clients may send its commands to the autopilot too."""

    def __init__(self, component: CameraComponent) -> None:
        self._component = component

    def commands(self) -> Mapping[int, CommandHandler]:
        return {
            CameraCommand.DIGICAM_CONTROL: self._digicam,
            CameraCommand.TRIGGER_DISTANCE: self._trigger_distance,
            CameraCommand.TRIGGER_INTERVAL: self._trigger_interval,
            CameraCommand.TRIGGER_CONTROL: self._trigger_control,
            CameraCommand.SET_MODE: self._set_mode,
            CameraCommand.SET_ZOOM: self._set_zoom,
            CameraCommand.SET_FOCUS: self._set_focus,
            CameraCommand.START_PHOTOS: self._start_photos,
            CameraCommand.STOP_PHOTOS: self._stop_photos,
            CameraCommand.START_VIDEO: self._start_video,
            CameraCommand.STOP_VIDEO: self._stop_video,
        }

    def _digicam(self, command: Command) -> Reply:
        """Takes a photo, or steps the zoom (the older form).

        Params: p3 zoom steps; p5 1: a photo.
        Refused: TEMPORARILY_REJECTED: busy; FAILED: no storage, or it is full.
        """
        return self._component.run(command)

    def _trigger_distance(self, command: Command) -> Reply:
        """Takes a photo each so many metres of way, by estimate.

        Params: p1 distance [m], 0: no more; p3 1: the first one here; p4 camera (0, 1 or 100).
        Refused: DENIED: the distance is negative, or there is no such camera; FAILED: no storage, or it is full.
        """
        return self._component.run(command)

    def _trigger_interval(self, command: Command) -> Reply:
        """Takes a photo each so many milliseconds, from now on.

        Params: p1 interval [ms], 0 or less: no more; p3 camera (0, 1 or 100).
        Refused: DENIED: the interval is below 200 ms; FAILED: no storage, or it is full.
        """
        return self._component.run(command)

    def _trigger_control(self, command: Command) -> Reply:
        """Ends triggering, or counts photos from 0 again.

        Params: p1 0: end; p2 1: count anew; p3 1: end; p4 camera (0, 1 or 100).
        Refused: DENIED: it is to start, and neither a distance nor an interval has been given.
        """
        return self._component.run(command)

    def _set_mode(self, command: Command) -> Reply:
        """Sets the camera's mode; photos and videos can be taken in each.

        Params: p1 camera (0, 1 or 100); p2 CAMERA_MODE.
        Refused: DENIED: no such camera or mode.
        """
        return self._component.run(command)

    def _set_zoom(self, command: Command) -> Reply:
        """Zooms from 1 to 4.

        Params: p1 CAMERA_ZOOM_TYPE: 0 steps, 1 rate, 2 percent, 3 focal length [mm], 4 field of view [deg]; p2 value;
        p3 camera (0, 1 or 100).
        Refused: DENIED: no such camera or type, or the value is out of range.
        """
        return self._component.run(command)

    def _set_focus(self, command: Command) -> Reply:
        """Focuses from 0.3 m to infinity.

        Params: p1 SET_FOCUS_TYPE: 0 steps, 1 rate, 2 percent, 3 metres, 4 to 6 automatic; p2 value; p3 camera (0, 1 or
        100).
        Refused: DENIED: no such camera or type, or the value is out of range.
        """
        return self._component.run(command)

    def _start_photos(self, command: Command) -> Reply:
        """Takes one photo or a series.

        Params: p1 camera (0, 1 or 100); p2 interval [s]; p3 number, 0 until stopped.
        Refused: TEMPORARILY_REJECTED: busy; FAILED: no storage, or it is full; DENIED: the interval is below 0.2 s.
        """
        return self._component.run(command)

    def _stop_photos(self, command: Command) -> Reply:
        """Ends every series and trigger.

        Params: p1 camera (0, 1 or 100).
        Refused: DENIED: no such camera.
        """
        return self._component.run(command)

    def _start_video(self, command: Command) -> Reply:
        """Starts recording to a file.

        Params: p3 camera (0, 1 or 100).
        Refused: TEMPORARILY_REJECTED: already recording; FAILED: no storage, or it is full.
        """
        return self._component.run(command)

    def _stop_video(self, command: Command) -> Reply:
        """Completes the recording, if there is one.

        Params: p2 camera (0, 1 or 100).
        Refused: DENIED: no such camera.
        """
        return self._component.run(command)
