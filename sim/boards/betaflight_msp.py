"""Questions to a running Betaflight over MSP, its serial protocol, at the TCP port of its first UART.

Facts: src/main/msp of Betaflight 4.6. It takes one client at a time, and answers while its clock runs.
"""

import socket
from struct import unpack_from

from sim.boards.outside import PeerError

PORT = 5761
FC_VARIANT, FC_VERSION, STATUS_EX = 2, 3, 150
VARIANT, VERSION = b"BTFL", (4, 6)
_ANSWER_S = 1.0
_READ_MAX = 4096
_ARMING_AT = 15  # of STATUS_EX: the count of bytes of further flight modes, which stand before its reasons
_REASONS = (
    "NOGYRO FAILSAFE RXLOSS NOT_DISARMED BOXFAILSAFE RUNAWAY CRASH THROTTLE ANGLE BOOTGRACE NOPREARM LOAD CALIB CLI "
    "CMS BST MSP PARALYZE GPS RESCUE_SW DSHOT_TELEM REBOOT_REQD DSHOT_BBANG NO_ACC_CAL MOTOR_PROTO FLIP_SWITCH "
    "ALT_HOLD_SW POS_HOLD_SW ARM_SWITCH"
).split()


def ask(*codes: int, address: str = "127.0.0.1", port: int = PORT, answer_s: float = _ANSWER_S) -> list[bytes] | None:
    """What it answers to each; None: it does not, or not in time. By one connection: each is a risk to its server."""
    answers: list[bytes] = []
    try:
        with socket.create_connection((address, port), timeout=answer_s) as peer:
            for code in codes:
                peer.sendall(bytes((*b"$M<", 0, code, code)))
                answer = _received(peer, code)
                if answer is None:
                    return None
                answers.append(answer)
    except OSError:
        return None
    return answers


def is_reached(address: str = "127.0.0.1", port: int = PORT) -> bool:
    """Whether one runs that has started up.

    Raises:
        PeerError: it is another version.
    """
    answers = ask(FC_VARIANT, FC_VERSION, address=address, port=port)
    if answers is None:
        return False
    variant, version = answers
    if variant != VARIANT or tuple(version[:2]) != VERSION:
        reported = f"{variant.decode(errors='replace')} {'.'.join(map(str, version))}"
        raise PeerError(f"the autopilot at TCP port {port} is {reported}, and not Betaflight 4.6")
    return True


def _received(peer: socket.socket, code: int) -> bytes | None:
    received = b""
    while data := peer.recv(_READ_MAX):
        received = (received + data)[-_READ_MAX:]
        answer = payload_of(received, code)
        if answer is not None:
            return answer
    return None


def payload_of(received: bytes, code: int) -> bytes | None:
    """What the first whole answer to this code in what has been received holds."""
    start = received.find(b"$M>")
    while start >= 0:
        frame = received[start + 3 :]
        if len(frame) >= 2 and frame[1] == code and len(frame) >= frame[0] + 3:
            checked = frame[: frame[0] + 2]
            check = 0
            for byte in checked:
                check ^= byte
            if check == frame[frame[0] + 2]:
                return checked[2:]
        start = received.find(b"$M>", start + 1)
    return None


def arming_reasons(status_ex: bytes) -> list[str]:
    """Why it does not arm, by the words of its own `status`."""
    if len(status_ex) <= _ARMING_AT:
        return []
    at = _ARMING_AT + 1 + status_ex[_ARMING_AT] + 1
    if len(status_ex) < at + 4:
        return []
    (flags,) = unpack_from("<I", status_ex, at)
    return [reason for k, reason in enumerate(_REASONS) if flags >> k & 1]
