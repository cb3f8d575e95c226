"""The commands of the vehicle's shell. Each asks what a MAVLink client could ask too, with the same checks."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import degrees, isfinite, nan
from typing import Any

from autopilot.interface.client_requests import ChangeMode, LandAt, TakeOff
from autopilot.interface.item_lists import ListKind, item_name
from autopilot.interface.vehicle_state import LandedState, Reply, Verdict
from autopilot.mavlink.channel import Endpoint
from autopilot.mavlink.services.identity import PROJECT, project_version

Lines = Iterable[str]


@dataclass(frozen=True, slots=True)
class _Entry:
    """One line of the table of commands."""

    usage: str
    meaning: str
    run: Callable[[Sequence[str]], Lines]


class ShellCommands:
    """Runs lines.

    Args:
        endpoint: the vehicle, and its parameters under the names its clients know.
    """

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._vehicle = endpoint.vehicle
        specs = sorted(endpoint.vehicle.modes.values(), key=lambda spec: spec.mode)
        theirs = sorted((spec for spec in specs if spec.shell_name), key=lambda spec: spec.nav_state)
        self._modes = {spec.shell_name: spec.mode for spec in theirs}  # PX4's names, besides our own
        self._modes |= {spec.mode.name.lower(): spec.mode for spec in specs}
        self._table: Mapping[str, _Entry] = {
            "help": _Entry("help", "this list", self._help),
            "status": _Entry("status", "what the vehicle is doing", self._status),
            "param": _Entry("param show [PATTERN] | param set NAME VALUE", "parameters", self._param),
            "listener": _Entry(
                "listener [TOPIC]", "the last row of a log topic; all names without one", self._listener
            ),
            "commander": _Entry(
                "commander arm|disarm [-f] | takeoff | land | mode NAME | check | status",
                "arming and modes",
                self._commander,
            ),
            "mission": _Entry("mission status", "the mission", self._mission),
            "logger": _Entry("logger status", "the flight logs", self._logger),
            "ver": _Entry("ver all", "versions", self._versions),
            "reboot": _Entry("reboot", "restarts the vehicle", self._reboot),
        }

    def run(self, line: str) -> Lines:
        """What a line prints."""
        name, *arguments = line.split() or [""]
        if not name:
            return ()
        entry = self._table.get(name)
        if entry is None:
            return (f"nsh: {name}: command not found",)
        return entry.run(arguments)

    def _usage(self, name: str) -> Lines:
        return (f"usage: {self._table[name].usage}",)

    def _help(self, _: Sequence[str]) -> Lines:
        return [f"  {entry.usage}\n      {entry.meaning}" for entry in self._table.values()]

    def _status(self, _: Sequence[str]) -> Lines:
        state = self._vehicle.state
        position, (north, east, down) = state.position, state.estimate.pos_ned
        yield f"time       {state.time_us * 1e-6:.2f} s"
        yield from self._arming_status()
        yield f"position   {position.lat_deg:.7f} {position.lon_deg:.7f} deg, {position.alt_m:.1f} m AMSL"
        yield f"local      north {north:.2f} east {east:.2f} down {down:.2f} m"
        yield f"attitude   roll {degrees(state.roll_rad):.1f} pitch {degrees(state.pitch_rad):.1f} " + (
            f"yaw {degrees(state.yaw_rad) % 360.0:.1f} deg"
        )
        yield f"battery    {100.0 * state.battery_remaining:.0f} %"
        yield from self._mission(["status"])

    def _arming_status(self) -> Lines:
        state = self._vehicle.state
        yield f"mode       {state.mode.name}{', failsafe' if state.is_failsafe else ''}"
        yield f"armed      {'yes' if state.is_armed else 'no'}, {LandedState(state.landed_state).name}"

    # Parameters

    def _param(self, arguments: Sequence[str]) -> Lines:
        match arguments:
            case ["show"]:
                return self._shown("*")
            case ["show", pattern]:
                return self._shown(pattern)
            case ["set", name, value]:
                return (self._set(name, value),)
            case _:
                return self._usage("param")

    def _shown(self, pattern: str) -> Lines:
        view = self._endpoint.parameters
        names = [name for name in view.names if fnmatchcase(name, pattern.upper())]
        lines = [f"{'*' if view.value(name) != view.default(name) else ' '} {self._named(name)}" for name in names]
        return [*lines, f"{len(names)} of {len(view)} parameters, * differs from its default"]

    def _named(self, name: str) -> str:
        view = self._endpoint.parameters
        value = view.value(name)
        return f"{name}: {value if view.is_integer(name) else format(value, '.6g')}"

    def _set(self, name: str, text: str) -> str:
        view = self._endpoint.parameters
        if name not in view:
            return f"param: {name}: there is none of this name"
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not isfinite(value) or (view.is_integer(name) and value != int(value)):
            return f"param: {text} is not {'an integer' if view.is_integer(name) else 'a number'}"
        before = self._named(name)
        view.set(name, value)
        return f"{before} -> {self._named(name).removeprefix(f'{name}: ')}"

    # Logs

    def _listener(self, arguments: Sequence[str]) -> Lines:
        log = self._vehicle.host.log_stream
        if log is None:
            return ("listener: nothing is logged",)
        if len(arguments) != 1:
            return log.topics()
        try:
            row = log.latest(arguments[0])
        except KeyError:
            return (f"listener: {arguments[0]}: there is no such topic",)
        if row is None:
            return (f"listener: {arguments[0]}: never published",)
        return [f"TOPIC: {arguments[0]}", *(f"    {name}: {_value_text(value)}" for name, value in row.items())]

    def _logger(self, arguments: Sequence[str]) -> Lines:
        if list(arguments) != ["status"]:
            return self._usage("logger")
        stored = self._vehicle.host.logs
        logs = () if stored is None else stored.logs()
        total = sum(log.size for log in logs)
        newest = f"; the newest is {logs[-1].name}, {logs[-1].size} bytes" if logs else ""
        return (f"{len(logs)} logs, {total} bytes{newest}",)

    # Flying

    def _commander(self, arguments: Sequence[str]) -> Lines:
        vehicle = self._vehicle
        match arguments:
            case ["arm"] | ["arm", "-f"]:
                return _reply_lines(vehicle.arm(force=len(arguments) == 2))
            case ["disarm"] | ["disarm", "-f"]:
                return _reply_lines(vehicle.disarm(force=len(arguments) == 2))
            case ["takeoff"]:
                return self._take_off()
            case ["land"]:
                return _reply_lines(vehicle.request(LandAt()))
            case ["mode", name]:
                mode = self._modes.get(name.lower())
                if mode is None:
                    return (f"commander: {name}: no such mode; there are {' '.join(self._modes)}",)
                return _reply_lines(vehicle.request(ChangeMode(mode)))
            case ["check"]:
                return vehicle.check_arming() or ("ready to arm",)
            case ["status"]:
                return self._arming_status()
            case _:
                return self._usage("commander")

    def _take_off(self) -> Lines:
        """Arms too, as PX4's command does."""
        vehicle = self._vehicle
        reply = vehicle.request(TakeOff())
        if reply.verdict is Verdict.ACCEPTED and not vehicle.state.is_armed:
            reply = vehicle.arm(force=False)
        return _reply_lines(reply)

    def _mission(self, arguments: Sequence[str]) -> Lines:
        if list(arguments) != ["status"]:
            return self._usage("mission")
        state = self._vehicle.state
        items = self._vehicle.lists.items(ListKind.MISSION)
        where = f", {item_name(state.mission_current)} is next" if items else ""
        return (f"mission    {len(items)} items{where}",)

    def _versions(self, arguments: Sequence[str]) -> Lines:
        if list(arguments) != ["all"]:
            return self._usage("ver")
        dialect = self._endpoint.dialect
        return (
            f"{PROJECT} {project_version()}",
            f"compatible with {dialect.name} {_version_text(dialect.flight_sw_version)}",
            f"system id {self._endpoint.sysid}",
        )

    def _reboot(self, _: Sequence[str]) -> Lines:
        return _reply_lines(self._vehicle.reboot())


def _reply_lines(reply: Reply) -> Lines:
    if reply.verdict is Verdict.ACCEPTED:
        return ("accepted",)
    return (f"{reply.verdict.name.lower().replace('_', ' ')}: {reply.reason}",)


def _value_text(value: Any) -> str:
    """A number, or an array's numbers, as PX4's listener shows them."""
    if getattr(value, "ndim", 0):
        return f"[{', '.join(_value_text(element) for element in value)}]"
    return f"{float(value):.5f}" if getattr(value.dtype, "kind", "") == "f" else str(value)


def _version_text(number: int) -> str:
    return f"{number >> 24}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}"
