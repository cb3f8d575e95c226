"""The text of docs/reference/mavlink.md: what the vehicle says, understands and refuses, from the server's tables."""

import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import all as definitions

from autopilot.interface.ardupilot_vehicle import Alias
from autopilot.interface.vehicle_state import Mode
from autopilot.mavlink.components.component import Component
from autopilot.mavlink.dialects import Dialect
from autopilot.mavlink.dialects.ardupilot import ARDUPILOT
from autopilot.mavlink.dialects.px4 import PX4
from autopilot.mavlink.server import MavlinkServer
from autopilot.mavlink.service import CommandHandler
from autopilot.mavlink.telemetry.telemetry_rates import Stream
from autopilot.mavlink.wire.codec import known_type

ROOT = Path(__file__).parents[2]
HEADER = """\
# MAVLink

Written by `python -m docs.generate` from the code: do not edit.

What the vehicle says and understands. How to connect each ground station or library is in
[clients](../how-to/clients.md); the parameters are in [parameters](parameters.md). Time is simulated time everywhere:
rates, intervals and time-outs count the vehicle's seconds, which pass faster than yours with `--speed` above 1.

Rules that hold for everything below:

- A command is acknowledged once, to who sent it, at once; while it takes time the acknowledgement says IN_PROGRESS and
  a final one follows. A command that is not in the table is answered UNSUPPORTED. A STATUSTEXT explains each refusal.
- In a command NaN means "default" and 0 is a value. An infinite parameter is refused, and so is one beyond 1e10.
- Positions are latitude and longitude in degrees; COMMAND_INT carries them exactly, COMMAND_LONG to about a metre.
- Every message with a rate can be asked for at another one (SET_MESSAGE_INTERVAL, for one link only) or once
  (REQUEST_MESSAGE).
"""

_COMMAND_HEADINGS = ("command", "number", "what it does", "parameters", "refused")


def mavlink_text(server: MavlinkServer) -> str:
    """The whole page."""
    return "\n".join(
        [
            HEADER,
            "## Messages sent\n",
            *_table(
                ("message", "id", "to ground stations", "to offboard clients", "contents"), _streams(server.streams)
            ),
            "\nRates in Hz; asked: only when it is asked for. In answer to something, or when something happens:\n",
            *_table(("message", "id", "by"), _answers({stream.name for stream in server.streams})),
            "\n## Messages understood\n",
            *_table(("message", "id", "what is done with it"), _understood(server)),
            "\n## Commands\n",
            *_table(
                ("command", "number", "what it does", "parameters", "refused"), _commands(server.command_handlers())
            ),
            "",
            *(line for component in server.components for line in _component(component)),
            "## Flight modes\n",
            *_table(("mode", "PX4: name, main / sub mode", "ArduPilot: name, number"), _modes()),
            "\nA mode without a name is shown as the one whose numbers stand there, and entered by a command or a "
            "failsafe.\n",
            "## ArduPilot's parameter names\n",
            "With `--dialect ardupilot` these names stand for [parameters](parameters.md) of ours, in ArduPilot's "
            "units; all other parameters keep their own names. Setting one sets ours.\n",
            *_table(("ArduPilot", "ours", "ours to ArduPilot's"), _aliases()),
            "\nThese can be read and are never changed:\n",
            *_table(("name", "value", "meaning"), ((c.name, f"{c.value:g}", c.meaning) for c in ARDUPILOT.constants)),
            "",
        ]
    )


def _table(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[str]:
    titles = list(headings)
    yield f"| {' | '.join(titles)} |"
    yield "|" + "---|" * len(titles)
    for row in rows:
        yield f"| {' | '.join(str(cell).replace('|', ' or ') for cell in row)} |"


def _streams(streams: Iterable[Stream]) -> Iterator[tuple[object, ...]]:
    for stream in sorted(streams, key=lambda each: each.name):
        rates = (f"{rate:g}" if rate else "asked" for rate in (stream.ground_hz, stream.onboard_hz))
        yield stream.name, known_type(stream.name).msg_id, *rates, sections(stream.build)[""]


def _answers(streamed: set[str]) -> Iterator[tuple[object, ...]]:
    """Messages that the modules of the server name without streaming them."""
    senders: dict[str, str] = {}
    received = set()
    for path in sorted((ROOT / "autopilot" / "mavlink").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        module = path.relative_to(ROOT / "autopilot").as_posix()
        for name in re.findall(r'^\w+ = known_type\("(\w+)"\)(?!\.msg_id)', text, re.MULTILINE):
            senders.setdefault(name, module)
        received.update(re.findall(r'message_id\("(\w+)"\)', text))
    for name in sorted(set(senders) - streamed - received):
        yield name, known_type(name).msg_id, f"`{senders[name]}`"


def _understood(server: MavlinkServer) -> Iterator[tuple[object, ...]]:
    for name, handler in sorted(server.message_handlers().items()):
        yield name, known_type(name).msg_id, sections(handler)[""]


def _component(component: Component) -> Iterator[str]:
    """What a component besides the autopilot says and understands."""
    yield f"## {component.title} (component {component.compid})\n"
    payloads = sorted(component.payloads().items())
    if payloads:
        rows = ((name, known_type(name).msg_id, sections(payload)[""]) for name, payload in payloads)
        yield from _table(("message, when it is asked for", "id", "contents"), rows)
        yield ""
    messages = sorted(component.messages().items())
    if messages:
        rows = ((name, known_type(name).msg_id, sections(handler)[""]) for name, handler in messages)
        yield from _table(("message understood", "id", "what is done with it"), rows)
        yield ""
    yield from _table(_COMMAND_HEADINGS, _commands(component.known))
    yield ""


def _commands(handlers: Mapping[int, CommandHandler]) -> Iterator[tuple[object, ...]]:
    for number, handler in sorted(handlers.items()):
        entry = definitions.enums["MAV_CMD"].get(number)
        name = entry.name.removeprefix("MAV_CMD_") if entry else f"command {number}"
        parts = sections(handler)
        yield name, number, parts[""], parts.get("Params", ""), parts.get("Refused", "")


def sections(function: Callable[..., Any]) -> dict[str, str]:
    """The first line of a docstring under "", and its labelled paragraphs (`Params: …`) under their labels."""
    function = getattr(function, "func", function)  # what a partial calls
    lines = (inspect.getdoc(function) or "").splitlines()
    parts = {"": lines[0].strip() if lines else ""}
    label = ""
    for line in lines[1:]:
        match = re.match(r"(Params|Refused): *(.*)", line)
        if match:
            label = match[1]
            parts[label] = match[2].strip()
        elif not line.strip():
            label = ""
        elif label:
            parts[label] += " " + line.strip()
    return parts


def _modes() -> Iterator[tuple[object, ...]]:
    names = {dialect.name: {row.mode: row.name for row in dialect.modes} for dialect in (PX4, ARDUPILOT)}
    for mode in Mode:
        px4 = PX4.custom_mode(mode)
        numbers = f"{px4 >> 16 & 0xFF} / {px4 >> 24 & 0xFF}", _number(ARDUPILOT, mode)
        shown = (
            f"{names[dialect.name].get(mode, '')} {number}".strip()
            for dialect, number in zip((PX4, ARDUPILOT), numbers, strict=True)
        )
        yield mode.name, *shown


def _number(dialect: Dialect, mode: Mode) -> str:
    return str(dialect.custom_mode(mode))


def _aliases() -> Iterator[tuple[object, ...]]:
    for alias in sorted(ARDUPILOT.aliases, key=lambda each: each.name):
        yield alias.name, alias.of, _conversion(alias)


def _conversion(alias: Alias) -> str:
    if alias.numbers is not None:
        return ", ".join(f"{ours} is {theirs}" for ours, theirs in alias.numbers.items())
    return "" if alias.scale == 1.0 else f"times {alias.scale:g}"
