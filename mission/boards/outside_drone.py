"""What the scripting clients of other autopilots have in common: whose ned their scripts speak.

An autopilot's local frame begins where it boots. Several vehicles in one world have one frame, and a script says where
in that: places go to and come from the autopilot as latitude, longitude and altitude.
"""

from math import isnan, nan

from common.geodesy import GeoPoint, geodetic_from_ned, ned_from_geodetic
from mission.script import FREE_ACCELERATION, FREE_VELOCITY, FREE_YAW, FREE_YAW_RATE, Drone

FRAME_GLOBAL_INT = 5  # PX4 takes setpoints in this one, and not in 0


class OutsideDrone(Drone):
    """See `Drone`."""

    frame_origin: GeoPoint | None = None
    """Of the ned that its script speaks; None: the vehicle's own local frame."""

    @property
    def pos_ned(self) -> tuple[float, float, float]:
        """[m] The vehicle's own estimate, in the frame of the script."""
        if self.frame_origin is None:
            return super().pos_ned
        place = self.latest("GLOBAL_POSITION_INT")
        if place is None or place.lat == place.lon == 0:  # or it does not know yet
            return nan, nan, nan
        return ned_from_geodetic(place.lat * 1e-7, place.lon * 1e-7, place.alt * 1e-3, self.frame_origin)

    @property
    def origin(self) -> GeoPoint:
        return super().origin if self.frame_origin is None else self.frame_origin

    def _height_m(self) -> float:
        if self.frame_origin is None or self.latest("HOME_POSITION") is None:
            return super()._height_m()
        return self.frame_origin.alt_m - self.home.alt_m - self.pos_ned[2]

    def offboard_position(self, north_m: float, east_m: float, down_m: float, yaw_rad: float = nan) -> None:
        if self.frame_origin is None:
            super().offboard_position(north_m, east_m, down_m, yaw_rad)
            return
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north_m, east_m, down_m, self.frame_origin)
        fields = {
            "coordinate_frame": FRAME_GLOBAL_INT,
            "type_mask": FREE_VELOCITY | FREE_ACCELERATION | FREE_YAW_RATE | (FREE_YAW if isnan(yaw_rad) else 0),
            "lat_int": round(lat_deg * 1e7),
            "lon_int": round(lon_deg * 1e7),
            "alt": alt_m,
            **dict.fromkeys(("vx", "vy", "vz", "afx", "afy", "afz", "yaw_rate"), 0.0),
            "yaw": 0.0 if isnan(yaw_rad) else yaw_rad,
        }
        self._offboard = lambda time_ms: self.ask("SET_POSITION_TARGET_GLOBAL_INT", time_boot_ms=time_ms, **fields)
