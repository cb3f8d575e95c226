"""The protocol half of the scripting client: frames, commands, missions and parameters, in simulated time.

In: bytes from a link, once per frame. Out: heartbeats at 1 Hz, the offboard setpoint at 20 Hz, requests and
their re-sends. Coroutines wait for messages by letting frames pass; nothing sleeps and nothing reads a wall clock.
"""

from collections import deque
from collections.abc import Callable, Coroutine, Generator, Iterable, Sequence
from types import TracebackType, coroutine
from typing import Any, Self

from autopilot.mavlink.client_end import AUTOPILOT_COMPONENT, IN_PROGRESS, ByteLink, ClientEnd, frame_of
from autopilot.mavlink.wire.codec import Frame, Message, decode, message_id
from mission.client_fields import PARAMETER_IS_REAL, item_fields, parameter_from_wire, parameter_to_wire, plan_item
from mission.plan.plan_file import PlanItem

CLIENT_SYSTEM_ID = 245
CLIENT_COMPONENT_ID = 190  # MAV_COMP_ID_MISSIONPLANNER, as MAVSDK uses
OFFBOARD_PERIOD_US = 50_000
COMMAND_TIMEOUT_S = 1.5
COMMAND_TRIES = 3
TRANSFER_TIMEOUT_S = 1.5


class ScriptError(RuntimeError):
    """The script cannot go on."""


class ScriptTimeout(ScriptError):
    """Something awaited did not happen in time."""


class CommandRefused(ScriptError):
    """The vehicle refused a command; `result` is the MAV_RESULT and the message carries its reason."""

    def __init__(self, name: str, result: int, reason: str) -> None:
        super().__init__(f"{name} refused (result {result}): {reason or 'no reason given'}")
        self.result = result
        self.reason = reason


class MissionRefused(ScriptError):
    """The vehicle did not take the mission; `result` is the MAV_MISSION_RESULT."""

    def __init__(self, result: int, reason: str) -> None:
        super().__init__(f"mission refused (result {result}): {reason or 'no reason given'}")
        self.result = result


@coroutine
def next_frame() -> Generator[None, None, None]:
    """Lets one frame of the simulation pass."""
    yield


class Running:
    """A script under way."""

    def __init__(self, script: Coroutine[Any, Any, Any]) -> None:
        self._script = script
        self.is_done = False
        self.result: Any = None
        self.error: ScriptError | None = None

    def step(self) -> None:
        """Runs the script to its next wait."""
        if self.is_done:
            return
        try:
            self._script.send(None)
        except StopIteration as stop:
            self.is_done, self.result = True, stop.value
        except ScriptError as error:
            self.is_done, self.error = True, error

    def cancel(self) -> None:
        """Ends the script where it is; without effect once it is done."""
        self._script.close()
        if not self.is_done:
            self.is_done, self.error = True, ScriptError("stopped before its end")


class Inbox:
    """Messages of some kinds, in order, while the `with` block lasts."""

    def __init__(self, client: "Client", names: Iterable[str]) -> None:
        self._client = client
        self._ids = {message_id(name) for name in names}
        self._queue: deque[Message] = deque()

    def __enter__(self) -> Self:
        self._client._inboxes.append((self._ids, self._queue))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client._inboxes.remove((self._ids, self._queue))

    async def next(self, timeout_s: float, what: str) -> Any:
        """The fields of the next message; as `next_message`."""
        return (await self.next_message(timeout_s, what)).fields

    async def next_message(self, timeout_s: float, what: str) -> Message:
        """The next message.

        Raises:
            ScriptTimeout: none came in time.
        """
        await self._client.until(lambda: bool(self._queue), timeout_s, what)
        return self._queue.popleft()


class Client:
    """The vehicle at the other end of a link.

    Args:
        link: bytes to and from the vehicle.
        system_id: of the vehicle.
    """

    sends_parameters_as_floats = False
    """ArduPilot's way; PX4's: an integer's bits travel in the float."""

    def __init__(self, link: ByteLink, *, system_id: int = 1) -> None:
        self.time_us = 0
        self.lost = ""
        """Why the vehicle will not answer any more."""
        self.texts: list[str] = []
        self.reached: list[int] = []  # items of the present mission
        self._text_id = 0  # of the last text
        # An onboard computer: the loss of a script is no loss of the ground station
        self._end = ClientEnd(link, CLIENT_SYSTEM_ID, CLIENT_COMPONENT_ID, vehicle_id=system_id)
        self._latest: dict[int, Frame | bytes] = {}  # by message; bytes: a whole frame that nobody has looked at
        self._fields: dict[int, tuple[Frame | bytes, Any]] = {}  # of the frames in `_latest` that have been looked at
        self._inboxes: list[tuple[set[int], deque[Message]]] = []
        self._scripts: list[Running] = []
        self._next_offboard_us = 0
        self._offboard: Callable[[int], None] | None = None

    @property
    def system_id(self) -> int:
        """Of the vehicle."""
        return self._end.vehicle_id

    def frame(self, time_us: int) -> None:
        """Takes in what has arrived, sends what is due and runs the scripts to their next wait."""
        self.time_us = time_us
        self._receive()
        self._end.keep_alive(time_us)
        if self._offboard is not None and time_us >= self._next_offboard_us:
            self._next_offboard_us = time_us + OFFBOARD_PERIOD_US
            self._offboard(time_us // 1000 & 0xFFFFFFFF)
        for running in self._scripts:
            running.step()
        self._scripts = [running for running in self._scripts if not running.is_done]

    def start(self, script: Coroutine[Any, Any, Any]) -> Running:
        """Starts a script; it runs on as `frame` is called."""
        running = Running(script)
        self._scripts.append(running)
        return running

    async def until(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Returns when the condition holds.

        Raises:
            ScriptTimeout: it did not hold within `timeout_s` of the vehicle's time.
            ScriptError: the vehicle is lost.
        """
        deadline_us = self.time_us + int(timeout_s * 1e6)
        while not condition():
            if self.lost:
                raise ScriptError(self.lost)
            if self.time_us >= deadline_us:
                raise ScriptTimeout(f"{what}: nothing within {timeout_s:g} s")
            await next_frame()

    async def sleep(self, seconds: float) -> None:
        """Lets simulated time pass."""
        wake_us = self.time_us + int(seconds * 1e6)
        while self.time_us < wake_us:
            await next_frame()

    def latest(self, name: str) -> Any:
        """The fields of the last message of a kind, or None; decoded only when asked for."""
        msg_id = message_id(name)
        newest = self._latest.get(msg_id)
        if newest is None:
            return None
        known = self._fields.get(msg_id)
        if known is None or known[0] is not newest:
            known = self._fields[msg_id] = (newest, decode(frame_of(newest)).fields)
        return known[1]

    def send(self, name: str, **fields: Any) -> None:
        """Sends one message."""
        self._end.send(name, **fields)

    def ask(self, name: str, **fields: Any) -> None:
        """Sends one message to the vehicle's autopilot."""
        self._end.ask(name, **fields)

    def subscribe(self, *names: str) -> Inbox:
        """Collects messages of these kinds for the length of a `with` block."""
        return Inbox(self, names)

    async def command(self, command: int, *params: float, name: str = "", timeout_s: float = COMMAND_TIMEOUT_S) -> Any:
        """Sends a COMMAND_LONG and returns its accepting COMMAND_ACK.

        Raises:
            CommandRefused: any other answer.
            ScriptTimeout: no answer after three tries.
        """

        def ask(attempt: int) -> None:
            self._end.command(command, *params, attempt=attempt)

        return await self._command(ask, command, name or f"command {command}", timeout_s)

    async def command_int(
        self,
        command: int,
        frame: int,
        params: Sequence[float],
        x: int,
        y: int,
        z: float,
        *,
        name: str = "",
        component: int = AUTOPILOT_COMPONENT,
    ) -> Any:
        """As `command`, with a position: x and y are 1e7 degrees (or 1e4 metres in local frames).

        `component` may be another one of the vehicle than its autopilot.
        """
        fields: dict[str, Any] = {f"param{k + 1}": float(value) for k, value in enumerate(params)}

        def ask(_: int) -> None:
            place = {"frame": frame, "x": x, "y": y, "z": z}
            self.send(
                "COMMAND_INT",
                target_system=self.system_id,
                target_component=component,
                command=command,
                **place,
                **fields,
            )

        return await self._command(ask, command, name or f"command {command}", COMMAND_TIMEOUT_S)

    async def _command(self, ask: Callable[[int], None], command: int, name: str, timeout_s: float) -> Any:
        first_text = len(self.texts)
        with self.subscribe("COMMAND_ACK") as inbox:
            for attempt in range(COMMAND_TRIES):
                ask(attempt)
                try:
                    ack = await inbox.next(timeout_s, name)
                    while not self._end.is_answer(ack, command) or ack.result == IN_PROGRESS:
                        ack = await inbox.next(timeout_s, name)
                except ScriptTimeout:
                    continue
                if ack.result != 0:
                    await next_frame()
                    raise CommandRefused(name, ack.result, "; ".join(self.texts[first_text:]))
                return ack
        raise ScriptTimeout(f"{name}: no answer after {COMMAND_TRIES} tries")

    async def upload(self, items: Sequence[PlanItem], mission_type: int = 0) -> None:
        """Replaces the vehicle's mission, its fence (type 1) or its rally points (type 2).

        Raises:
            MissionRefused: the vehicle did not take it and keeps its old one.
        """
        first_text = len(self.texts)
        with self.subscribe("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK") as inbox:
            self.ask("MISSION_COUNT", mission_type=mission_type, count=len(items))
            while True:
                message = await inbox.next_message(6 * TRANSFER_TIMEOUT_S, "mission upload")
                request = message.fields
                if request.mission_type != mission_type:
                    continue
                if message.name == "MISSION_ACK":
                    if request.type != 0:
                        await next_frame()
                        raise MissionRefused(request.type, "; ".join(self.texts[first_text:]))
                    if mission_type == 0:
                        self.reached.clear()
                    return
                if request.seq < len(items):
                    self.ask("MISSION_ITEM_INT", mission_type=mission_type, **item_fields(items[request.seq]))

    async def download(self, mission_type: int = 0) -> list[PlanItem]:
        """The vehicle's mission, its fence (type 1) or its rally points (type 2)."""
        with self.subscribe("MISSION_COUNT", "MISSION_ITEM_INT") as inbox:
            self.ask("MISSION_REQUEST_LIST", mission_type=mission_type)
            count = (await inbox.next(TRANSFER_TIMEOUT_S, "mission count")).count
            items: list[PlanItem] = []
            while len(items) < count:
                self.ask("MISSION_REQUEST_INT", mission_type=mission_type, seq=len(items))
                message = await inbox.next_message(TRANSFER_TIMEOUT_S, f"mission item {len(items)}")
                if message.name == "MISSION_ITEM_INT" and message.fields.seq == len(items):
                    items.append(plan_item(message.fields))
            self.ask("MISSION_ACK", mission_type=mission_type, type=0)
            return items

    async def set_parameter(self, name: str, value: float) -> float:
        """Sets a parameter and returns the value the vehicle stored."""
        current = await self._read_parameter(name)
        with self.subscribe("PARAM_VALUE") as inbox:
            self.ask(
                "PARAM_SET",
                param_id=name,
                param_value=parameter_to_wire(value, self._type_of(current)),
                param_type=current.param_type,
            )
            return self._value_of(await self._parameter_named(inbox, name))

    async def get_parameter(self, name: str) -> float:
        """The value of a parameter."""
        return self._value_of(await self._read_parameter(name))

    def _type_of(self, message: Any) -> int:
        """Of the bits in a PARAM_VALUE."""
        return PARAMETER_IS_REAL if self.sends_parameters_as_floats else int(message.param_type)

    def _value_of(self, message: Any) -> float:
        return parameter_from_wire(message, is_real=self.sends_parameters_as_floats)

    async def _read_parameter(self, name: str) -> Any:
        with self.subscribe("PARAM_VALUE") as inbox:
            self.ask("PARAM_REQUEST_READ", param_id=name, param_index=-1)
            return await self._parameter_named(inbox, name)

    async def _parameter_named(self, inbox: Inbox, name: str) -> Any:
        while True:
            message = await inbox.next(TRANSFER_TIMEOUT_S, f"parameter {name}")
            if message.param_id == name:
                return message

    def _receive(self) -> None:
        for msg_id, sysid, compid, frame in self._end.arrived():
            if sysid == self.system_id:
                self._take(msg_id, compid, frame)

    def _take(self, msg_id: int, compid: int, frame: Frame | bytes) -> None:
        if msg_id == _HEARTBEAT_ID and compid != AUTOPILOT_COMPONENT:
            return  # a camera's or gimbal's: it tells nothing of the vehicle
        self._latest[msg_id] = frame
        if msg_id in _NOTED:
            self._note(decode(frame_of(frame)))
        for ids, queue in self._inboxes:
            if msg_id in ids:
                queue.append(decode(frame_of(frame)))

    def _note(self, message: Message) -> None:
        if message.name == "STATUSTEXT":
            self._note_text(message.fields)
        else:
            self.reached.append(message.fields.seq)

    def _note_text(self, fields: Any) -> None:
        """A text longer than one message comes in chunks of the same id."""
        if fields.id != 0 and fields.chunk_seq > 0 and fields.id == self._text_id:
            self.texts[-1] += fields.text
        else:
            self.texts.append(fields.text)
        self._text_id = fields.id


_HEARTBEAT_ID = message_id("HEARTBEAT")
_NOTED = {message_id("STATUSTEXT"), message_id("MISSION_ITEM_REACHED")}
