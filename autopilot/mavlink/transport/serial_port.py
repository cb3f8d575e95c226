"""A serial port as a client's link: the UART or USB cable between an onboard computer and a flight controller.

In and out: bytes. Nothing waits: what the port does not take at once goes with what is sent next. A cable that was
pulled out is tried again with everything that is sent, so that a client that sends heartbeats comes back by itself.
"""

import os
from collections.abc import Sequence

import serial

from autopilot.mavlink.transport.links import LinkError, LinkRole

_READ_MAX = 65_536  # [byte] at once
_UNSENT_MAX = 4_096  # [byte] more is given up: the other end has stopped reading


class SerialLink:
    """A serial port, 8 data bits, no parity, one stop bit, no flow control.

    Args:
        path: the device: "/dev/ttyACM0".
        baud: symbols per second; USB ports do not care.
        role: who is at the other end.

    Raises:
        LinkError: there is no such port, it may not be opened, or another program has it.
    """

    keeps_datagrams = False
    is_trusted = True  # a cable
    is_internal = False

    def __init__(self, path: str, baud: int, role: LinkRole) -> None:
        self.role = role
        self._path, self._baud = path, baud
        self._unsent = b""
        try:
            self._port: serial.Serial | None = self._opened()
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise LinkError(f"MAVLink: {path} cannot be opened at {baud} baud: {_reason(error)}.") from error

    def receive(self) -> Sequence[bytes]:
        """What has come in since the last call."""
        if self._port is None:
            return ()
        try:
            data = self._port.read(_READ_MAX)
        except OSError:
            self.close()
            return ()
        return (data,) if data else ()

    def send(self, data: bytes) -> None:
        """Sends what the port takes; opens it first if it went away."""
        try:
            if self._port is None:
                self._port = self._opened()
            self._unsent += data
            # not pyserial's write, which tries for ever while the other end does not read
            self._unsent = self._unsent[os.write(self._port.fileno(), self._unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self.close()
        if len(self._unsent) > _UNSENT_MAX:
            self._unsent = b""

    def close(self) -> None:
        self._unsent = b""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _opened(self) -> "serial.Serial":
        return serial.Serial(self._path, self._baud, timeout=0.0, write_timeout=0.0, exclusive=True)


def _reason(error: Exception) -> str:
    """The system's word for it, where there is one."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)
