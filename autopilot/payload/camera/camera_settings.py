"""What a client may set on the camera (PARAM_EXT, and the definition file): each changes the images."""

from dataclasses import dataclass

MODE = "CAM_MODE"  # a name that MAVSDK looks for
UINT8, UINT32, REAL32 = 1, 5, 9  # MAV_PARAM_EXT_TYPE
TYPE_NAMES = {UINT8: "uint8", UINT32: "uint32", REAL32: "float"}


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting and the values it may have."""

    name: str
    kind: int  # MAV_PARAM_EXT_TYPE
    default: float
    title: str
    options: tuple[tuple[str, float], ...]


PHOTO_SIZES = ((640, 360), (1280, 720), (1920, 1080))
VIDEO_SIZES = ((320, 180), (640, 360))
# Factors on red, green and blue by white balance: the first is right for the world's daylight.
BALANCES = ((1.0, 1.0, 1.0), (0.62, 0.95, 1.6), (0.85, 1.08, 1.1), (1.18, 1.0, 0.82))
QUALITIES = (70, 85, 95)  # JPEG

EXPOSURES_EV = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)


def _sizes(sizes: tuple[tuple[int, int], ...]) -> tuple[tuple[str, float], ...]:
    return tuple((f"{width} x {height}", float(i)) for i, (width, height) in enumerate(sizes))


def _numbered(*names: str) -> tuple[tuple[str, float], ...]:
    return tuple((name, float(i)) for i, name in enumerate(names))


SETTINGS = (
    Setting(MODE, UINT32, 0, "Mode", _numbered("Photo", "Video", "Survey")),
    Setting("CAM_PHOTORES", UINT32, 0, "Photo resolution", _sizes(PHOTO_SIZES)),
    Setting("CAM_VIDRES", UINT32, 0, "Video resolution", _sizes(VIDEO_SIZES)),
    Setting("CAM_EV", REAL32, 0.0, "Exposure compensation", tuple((f"{ev:+.1f}", ev) for ev in EXPOSURES_EV)),
    Setting("CAM_WBMODE", UINT32, 0, "White balance", _numbered("Daylight", "Incandescent", "Fluorescent", "Cloudy")),
    Setting("CAM_PHOTOQUAL", UINT32, 1, "Photo quality", _numbered("Low", "Normal", "High")),
    Setting("CAM_SMOOTH", UINT8, 1, "Smooth edges in photos", _numbered("Off", "On")),
)


class Settings:
    """Their values."""

    def __init__(self) -> None:
        self._declared = {setting.name: setting for setting in SETTINGS}
        self._values = {setting.name: setting.default for setting in SETTINGS}

    @property
    def names(self) -> list[str]:
        return list(self._declared)

    def declared(self, name: str) -> Setting | None:
        return self._declared.get(name)

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def set(self, name: str, value: float) -> bool:
        """Takes one of the setting's options; whether it is one."""
        setting = self._declared[name]
        match = next((option for _, option in setting.options if abs(option - value) < 1e-6), None)
        if match is None:
            return False
        self._values[name] = match
        return True

    def reset(self) -> None:
        self._values = {setting.name: setting.default for setting in SETTINGS}

    @property
    def photo_size(self) -> tuple[int, int]:
        return PHOTO_SIZES[int(self._values["CAM_PHOTORES"])]

    @property
    def video_size(self) -> tuple[int, int]:
        return VIDEO_SIZES[int(self._values["CAM_VIDRES"])]

    @property
    def exposure(self) -> float:
        """Factor on the light."""
        return float(2.0 ** self._values["CAM_EV"])

    @property
    def balance(self) -> tuple[float, float, float]:
        return BALANCES[int(self._values["CAM_WBMODE"])]

    @property
    def jpeg_quality(self) -> int:
        return QUALITIES[int(self._values["CAM_PHOTOQUAL"])]

    @property
    def is_smooth(self) -> bool:
        return bool(self._values["CAM_SMOOTH"])
