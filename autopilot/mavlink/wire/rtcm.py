"""GPS_RTCM_DATA: fragments of RTCM 3 messages put together, and checked as a receiver checks them.

A message longer than 180 bytes comes in up to four fragments; flags carry whether it is fragmented (bit 0), the number
of the fragment (bits 1, 2) and of the message (bits 3 to 7). The last fragment is the first one that is not full.
"""

FRAGMENT_LENGTH = 180
FRAGMENTS_MAX = 4
_PREAMBLE = 0xD3
_CRC24Q = 0x1864CFB


class RtcmAssembler:
    """Puts the fragments of one message at a time together; a new message drops an unfinished one."""

    def __init__(self) -> None:
        self._sequence = -1
        self._fragments: dict[int, bytes] = {}

    def add(self, flags: int, data: bytes) -> bytes | None:
        """Takes a fragment; returns the message it completes, None if it completes none or a damaged one."""
        if not flags & 1:
            return data if is_rtcm(data) else None
        number, sequence = flags >> 1 & 3, flags >> 3
        if sequence != self._sequence:
            self._sequence = sequence
            self._fragments.clear()
        self._fragments[number] = data
        message = b""
        for i in range(FRAGMENTS_MAX):
            fragment = self._fragments.get(i)
            if fragment is None:
                return None
            message += fragment
            if len(fragment) < FRAGMENT_LENGTH or i == FRAGMENTS_MAX - 1:
                self._fragments.clear()
                return message if is_rtcm(message) else None
        return None


def is_rtcm(data: bytes) -> bool:
    """Whether `data` is one or more whole RTCM 3 frames with right checksums (RTCM 10403.3, section 4)."""
    at = 0
    while at < len(data):
        if len(data) - at < 6 or data[at] != _PREAMBLE:
            return False
        end = at + 3 + (int.from_bytes(data[at + 1 : at + 3], "big") & 0x3FF)
        if end + 3 > len(data) or crc24q(data[at:end]) != int.from_bytes(data[end : end + 3], "big"):
            return False
        at = end + 3
    return at > 0


def crc24q(data: bytes) -> int:
    """Qualcomm's 24-bit checksum."""
    crc = 0
    for byte in data:
        crc ^= byte << 16
        for _ in range(8):
            crc <<= 1
            if crc & 0x1000000:
                crc ^= _CRC24Q
    return crc
