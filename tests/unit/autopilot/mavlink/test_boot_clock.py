"""The clock that clients see, after a restart of a vehicle that has been up for long."""

from pymavlink.dialects.v20 import all as mavlink

from autopilot.mavlink.boot_clock import BootClock
from autopilot.mavlink.wire.codec import known_type

DAY_US = 86_400_000_000
BOOT_US, NOW_US = 60 * DAY_US, 60 * DAY_US + 5_000_000


def shown(name, **fields):
    clock = BootClock()
    clock.boot_us = BOOT_US
    kind = known_type(name)
    payload = clock.shown(kind, kind.pack(**fields), NOW_US)
    return kind.unpack(payload)


def test_milliseconds_since_boot_are_those_since_the_restart():
    fields = shown("SYSTEM_TIME", time_unix_usec=0, time_boot_ms=NOW_US // 1000 % 2**32)
    assert fields.time_boot_ms == 5_000


def test_microseconds_in_32_bits_are_too():
    assert mavlink.MAVLink_servo_output_raw_message.fieldtypes[0] == "uint32_t"
    names = mavlink.MAVLink_servo_output_raw_message.fieldnames[1:]
    fields = shown("SERVO_OUTPUT_RAW", time_usec=(NOW_US - 4_000) % 2**32, **dict.fromkeys(names, 0))
    assert fields.time_usec == 4_996_000


def test_what_was_before_the_restart_is_0_and_what_is_not_known_stays():
    fields = shown("SYSTEM_TIME", time_unix_usec=0, time_boot_ms=(BOOT_US // 1000 - 20) % 2**32)
    assert fields.time_boot_ms == 0
    assert shown("SYSTEM_TIME", time_unix_usec=0, time_boot_ms=0).time_boot_ms == 0
