"""An aircraft as ADSB_VEHICLE carries it."""

from math import degrees, pi
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.aircraft import Aircraft
from autopilot.interface.vehicle_state import VehicleState
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import bounded_int, degrees_e7, i16, i32, u16

_VALID = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
    | mavlink.ADSB_FLAGS_VALID_CALLSIGN
)
_ADSB_VEHICLE = known_type("ADSB_VEHICLE")


def adsb_vehicle(state: VehicleState) -> bytes | None:
    """The nearest aircraft that is known; all of them are told once a second besides."""
    return None if state.nearest_aircraft is None else payload_of(state.nearest_aircraft)


def payload_of(aircraft: Aircraft) -> bytes:
    """ADSB_VEHICLE of an aircraft."""
    return _ADSB_VEHICLE.pack(**fields_of(aircraft))


def fields_of(aircraft: Aircraft) -> dict[str, Any]:
    """The fields of ADSB_VEHICLE."""
    return {
        "ICAO_address": aircraft.icao,
        "lat": degrees_e7(aircraft.lat_deg),
        "lon": degrees_e7(aircraft.lon_deg),
        "altitude_type": mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        "altitude": i32(aircraft.alt_amsl_m * 1000.0),
        "heading": round(degrees(aircraft.heading_rad % (2.0 * pi)) * 100.0) % 36_000,
        "hor_velocity": u16(aircraft.speed_m_s * 100.0),
        "ver_velocity": i16(aircraft.climb_m_s * 100.0),
        "callsign": aircraft.callsign[:8],
        "emitter_type": bounded_int(aircraft.emitter_type, 0, 255),
        "tslc": 1,
        "flags": _VALID,
        "squawk": u16(aircraft.squawk),
    }
