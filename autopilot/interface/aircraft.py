"""Another aircraft, as an ADS-B receiver reports it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Aircraft:
    """One report."""

    icao: int  # 24-bit address
    callsign: str
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float
    heading_rad: float
    speed_m_s: float  # over ground
    climb_m_s: float
    emitter_type: int = 0  # ADSB_EMITTER_TYPE
    squawk: int = 0
