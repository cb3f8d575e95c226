"""The vehicle's shell over SERIAL_CONTROL: lines in, text out, for several clients at once.

In: bytes for the device SHELL, in pieces of up to 70; a line ends with a line feed or a carriage return. Out: the line,
what it does (autopilot.mavlink.services.files.shell_commands), and the prompt, some pieces per frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.services.files.shell_commands import ShellCommands
from autopilot.mavlink.wire.codec import known_type

PROMPT = "nsh> "  # what PX4's users and their scripts look for
PIECE_BYTES = 70
PIECES_PER_FRAME = 10  # per client: 35 KB/s
LINE_BYTES_MAX = 200
OUTPUT_BYTES_MAX = 64_000  # waiting to be sent; a client that asks for more is told
CLIENTS_MAX = 8

_SERIAL_CONTROL = known_type("SERIAL_CONTROL")


@dataclass(slots=True)
class _Terminal:
    """One client's line so far, and what it has still to be sent."""

    line: bytearray = field(default_factory=bytearray)
    output: bytearray = field(default_factory=bytearray)
    was_return: bool = False  # the line feed of a carriage return and line feed ends no second line


class ShellService(Service):
    """Serves a shell to every client that types."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._commands = ShellCommands(endpoint)
        self._terminals: dict[Sender, _Terminal] = {}

    def messages(self) -> Mapping[str, Handler]:
        return {"SERIAL_CONTROL": self.typed}

    def typed(self, sender: Sender, fields: Any) -> None:
        """Carries out the lines typed at the shell (device 10); there are no other serial devices."""
        if fields.device != mavlink.SERIAL_CONTROL_DEV_SHELL or fields.flags & mavlink.SERIAL_CONTROL_FLAG_REPLY:
            return
        terminal = self._terminals.get(sender)
        if terminal is None:
            if len(self._terminals) >= CLIENTS_MAX:
                del self._terminals[next(iter(self._terminals))]
            terminal = self._terminals[sender] = _Terminal()
        for byte in bytes(fields.data[: min(fields.count, PIECE_BYTES)]):
            self._take(terminal, byte)

    def _take(self, terminal: _Terminal, byte: int) -> None:
        is_return, is_feed = byte == ord("\r"), byte == ord("\n")
        if is_feed and terminal.was_return:
            terminal.was_return = False
            return
        terminal.was_return = is_return
        if is_return or is_feed:
            line = terminal.line.decode("ascii", "replace")
            terminal.line.clear()
            self._print(terminal, f"{line}\n{self._answer(line)}{PROMPT}")
        elif len(terminal.line) <= LINE_BYTES_MAX and byte >= ord(" "):
            terminal.line.append(byte)

    def _answer(self, line: str) -> str:
        if len(line) > LINE_BYTES_MAX:
            return f"nsh: the line is longer than {LINE_BYTES_MAX} characters\n"
        return "".join(f"{text}\n" for text in self._commands.run(line))

    @staticmethod
    def _print(terminal: _Terminal, text: str) -> None:
        encoded = text.encode("ascii", "replace")
        if len(terminal.output) + len(encoded) > OUTPUT_BYTES_MAX:
            encoded = b"\nnsh: too much output\n" + PROMPT.encode()
            terminal.output.clear()
        terminal.output += encoded

    def frame(self) -> None:
        """Sends the next pieces."""
        for sender, terminal in self._terminals.items():
            for _ in range(PIECES_PER_FRAME):
                if not terminal.output:
                    break
                piece = bytes(terminal.output[:PIECE_BYTES])
                del terminal.output[:PIECE_BYTES]
                self._send(sender, piece)

    def _send(self, sender: Sender, piece: bytes) -> None:
        payload = _SERIAL_CONTROL.pack(
            device=mavlink.SERIAL_CONTROL_DEV_SHELL,
            flags=mavlink.SERIAL_CONTROL_FLAG_REPLY,
            count=len(piece),
            data=tuple(piece.ljust(PIECE_BYTES, b"\0")),
            target_system=sender.sysid,
            target_component=sender.compid,
        )
        self._endpoint.reply(sender, _SERIAL_CONTROL, payload)
