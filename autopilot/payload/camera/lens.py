"""Zoom and focus of the camera, driven by motors in simulated time."""

from math import atan, degrees, exp, isfinite, log, radians, tan

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict

WIDE_HFOV_DEG = 80.0  # a common wide lens for mapping drones
ZOOM_MAX = 4.0  # guess
ZOOM_STEP = 1.25  # factor per step; guess
ZOOM_FULL_TRAVEL_S = 4.0  # from wide to tele at full rate; guess
SENSOR_WIDTH_MM = 6.3  # 1/2.3 inch
SENSOR_HEIGHT_MM = 3.54  # of its 16:9 part
FOCAL_LENGTH_MM = 0.5 * SENSOR_WIDTH_MM / tan(radians(0.5 * WIDE_HFOV_DEG))
APERTURE_M = 0.004  # of the entrance pupil, and growing with the focal length; guess
FOCUS_NEAR_M = 0.3
FOCUS_FAR_M = 1000.0
FOCUS_FULL_TRAVEL_S = 2.0  # from near to far; guess
FOCUS_STEP = 0.1  # fraction of the travel


class Lens:
    """Zoom as a factor, focus as a distance; both may be moving."""

    def __init__(self) -> None:
        self._zoom_fraction = 0.0  # [0..1] of the travel
        self._focus_fraction = 1.0
        self._zoom_rate = 0.0  # [share/s]
        self._focus_rate = 0.0
        self._time_us = 0
        self.is_auto_focus = True

    def reset(self) -> None:
        """Wide, and focused by itself."""
        self._zoom_fraction, self._zoom_rate = 0.0, 0.0
        self._focus_fraction, self._focus_rate = 1.0, 0.0
        self.is_auto_focus = True

    def update(self, time_us: int) -> None:
        """Lets the motors run to a time."""
        dt_s = (time_us - self._time_us) * 1e-6
        self._time_us = time_us
        self._zoom_fraction = min(max(self._zoom_fraction + dt_s * self._zoom_rate, 0.0), 1.0)
        self._focus_fraction = min(max(self._focus_fraction + dt_s * self._focus_rate, 0.0), 1.0)

    @property
    def zoom(self) -> float:
        return float(exp(self._zoom_fraction * log(ZOOM_MAX)))

    @property
    def zoom_level(self) -> float:
        """[%] of the range."""
        return 100.0 * self._zoom_fraction

    @property
    def focus_level(self) -> float:
        """[%] of the range."""
        return 100.0 * self._focus_fraction

    @property
    def hfov_deg(self) -> float:
        return degrees(2.0 * atan(tan(radians(0.5 * WIDE_HFOV_DEG)) / self.zoom))

    @property
    def focus_m(self) -> float:
        """Distance in focus; linear in its inverse, as the lens travels."""
        near, far = 1.0 / FOCUS_NEAR_M, 1.0 / FOCUS_FAR_M
        return 1.0 / (near + self._focus_fraction * (far - near))

    def set_zoom(self, kind: int, value: float) -> Reply:
        """As SET_CAMERA_ZOOM: 0 steps, 1 rate, 2 percent, 3 focal length [mm], 4 horizontal field of view [deg]."""
        if not isfinite(value):
            return Reply(Verdict.DENIED, "the zoom value is not a number")
        if kind == 1:
            self._zoom_rate = min(max(value, -1.0), 1.0) / ZOOM_FULL_TRAVEL_S
            return ACCEPTED
        fractions = {
            0: lambda: self._zoom_fraction + value * log(ZOOM_STEP) / log(ZOOM_MAX),
            2: lambda: 0.01 * value,
            3: lambda: _fraction_of_zoom(value / FOCAL_LENGTH_MM),
            4: lambda: _fraction_of_zoom(
                tan(radians(0.5 * WIDE_HFOV_DEG)) / tan(radians(0.5 * min(max(value, 1.0), 170.0)))
            ),
        }
        if kind not in fractions:
            return Reply(Verdict.DENIED, f"there is no zoom type {kind}")
        if (kind == 2 and not 0.0 <= value <= 100.0) or (kind in (3, 4) and value <= 0.0):
            return Reply(Verdict.DENIED, f"zoom {value:g} is out of range")
        self._zoom_rate = 0.0
        self._zoom_fraction = min(max(fractions[kind](), 0.0), 1.0)
        return ACCEPTED

    def set_focus(self, kind: int, value: float) -> Reply:
        """As SET_CAMERA_FOCUS: 0 steps, 1 rate, 2 percent, 3 metres, 4 to 6 automatic."""
        if kind in (4, 5, 6):
            self.is_auto_focus, self._focus_rate = True, 0.0
            self._focus_fraction = 1.0  # whatever the drone looks at is far
            return ACCEPTED
        if not isfinite(value):
            return Reply(Verdict.DENIED, "the focus value is not a number")
        if kind not in (0, 1, 2, 3):
            return Reply(Verdict.DENIED, f"there is no focus type {kind}")
        if (kind == 2 and not 0.0 <= value <= 100.0) or (kind == 3 and value <= 0.0):
            return Reply(Verdict.DENIED, f"focus {value:g} is out of range")
        self.is_auto_focus = False
        self._focus_rate = min(max(value, -1.0), 1.0) / FOCUS_FULL_TRAVEL_S if kind == 1 else 0.0
        if kind == 0:
            self._focus_fraction += FOCUS_STEP * value
        elif kind == 2:
            self._focus_fraction = 0.01 * value
        elif kind == 3:
            near, far = 1.0 / FOCUS_NEAR_M, 1.0 / FOCUS_FAR_M
            self._focus_fraction = (1.0 / value - near) / (far - near)
        self._focus_fraction = min(max(self._focus_fraction, 0.0), 1.0)
        return ACCEPTED


def _fraction_of_zoom(zoom: float) -> float:
    return log(max(zoom, 1.0)) / log(ZOOM_MAX)
