"""ADSB_VEHICLE: what the vehicle's own receiver hears, told to everybody; what a receiver on a link hears, taken in."""

from collections.abc import Mapping
from math import radians
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot.interface.aircraft import Aircraft
from autopilot.mavlink.channel import Endpoint, Sender
from autopilot.mavlink.service import Handler, Service
from autopilot.mavlink.wire.adsb_messages import payload_of
from autopilot.mavlink.wire.codec import known_type
from autopilot.mavlink.wire.convert import degrees_from_e7, is_position

PERIOD_US = 1_000_000
_NEEDED = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE
_ADSB_VEHICLE = known_type("ADSB_VEHICLE")


class TrafficService(Service):
    """Sends every aircraft known once a second."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._next_us = 0

    def messages(self) -> Mapping[str, Handler]:
        return {"ADSB_VEHICLE": self.aircraft_received}

    def aircraft_received(self, _: Sender, fields: Any) -> None:
        """Takes in an aircraft that an ADS-B receiver on the link reports; one too near is NAV_TRAFF_AVOID's case."""
        lat_deg, lon_deg = degrees_from_e7(fields.lat), degrees_from_e7(fields.lon)
        if fields.flags & _NEEDED != _NEEDED or not is_position(lat_deg, lon_deg):
            return
        self._endpoint.vehicle.traffic.report(
            Aircraft(
                fields.ICAO_address,
                fields.callsign,
                lat_deg,
                lon_deg,
                fields.altitude * 1.0e-3,
                radians(fields.heading * 0.01),
                fields.hor_velocity * 0.01,
                fields.ver_velocity * 0.01,
                fields.emitter_type,
                fields.squawk,
            )
        )

    def frame(self) -> None:
        if self._endpoint.time_us < self._next_us:
            return
        self._next_us = self._endpoint.time_us + PERIOD_US
        for aircraft in self._endpoint.vehicle.traffic.known():
            self._endpoint.broadcast(_ADSB_VEHICLE, payload_of(aircraft))
