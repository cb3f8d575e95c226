"""An aircraft that ships with JSBSim, moved by it alone: its wings, engine, gear and atmosphere, 250 steps a second.

In: commands of a plane, wind, height of the ground. Out: motion, specific force, dynamic pressure. Its wheels stand on
level ground at the height below its centre of gravity; trees and boxes it does not meet.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from common.attitude import inverse, product, quat_of, rotated
from common.geodesy import GRAVITY_M_S2
from common.kernels import TICK_S
from sim.engines.jsbsim_planet import FT_M, MOTION, PLANET, put_at
from sim.engines.quiet_jsbsim import jsbsim

_SLUG_FT3_KG_M3 = 515.378819  # NIST SP 811
_RPM_RAD_S = np.pi / 30.0
# What a plane's commands (aileron, elevator, throttle, rudder, nose wheel, brake) are in JSBSim's senses: it counts an
# elevator positive that pitches down, and a rudder that yaws left.
_CONTROLS = {
    "fcs/aileron-cmd-norm": (0, 1.0),
    "fcs/elevator-cmd-norm": (1, -1.0),
    "fcs/throttle-cmd-norm": (2, 1.0),
    "fcs/rudder-cmd-norm": (3, -1.0),
    "fcs/steer-cmd-norm": (4, 1.0),
    "fcs/left-brake-cmd-norm": (5, 1.0),
    "fcs/right-brake-cmd-norm": (5, 1.0),
}
_WIND = [f"atmosphere/wind-{axis}-fps" for axis in ("north", "east", "down")]
_AIR = ["velocities/u-aero-fps", "atmosphere/rho-slugs_ft3", "propulsion/engine/propeller-rpm"]


class JsbsimAircraft:
    """One of them.

    Args:
        name: of the aircraft in JSBSim.
        home_alt_m: of home over sea level.

    Raises:
        ValueError: there is no such aircraft.
    """

    def __init__(self, name: str, home_alt_m: float) -> None:
        root = Path(jsbsim.get_default_root_dir())
        if not (root / "aircraft" / name / f"{name}.xml").is_file():
            raise ValueError(f"JSBSim has no aircraft '{name}'")
        self._sim = sim = jsbsim.FGFDMExec(str(root))
        with TemporaryDirectory() as folder:
            planet = Path(folder) / "planet.xml"
            planet.write_text(f'<?xml version="1.0"?>\n{PLANET}\n', encoding="utf-8")
            sim.load_planet(str(planet), False)
        sim.load_model(name)
        sim.disable_output()
        sim.set_dt(TICK_S)
        properties: Any = sim.get_property_manager()
        self._controls = [(properties.get_node(path), *of) for path, of in _CONTROLS.items()]
        self._wind = [properties.get_node(path) for path in _WIND]
        self._ground = properties.get_node("position/terrain-elevation-asl-ft")
        self._motion = [properties.get_node(path) for path in MOTION]
        self._air = [properties.get_node(path) for path in _AIR]
        units = range(int(sim["gear/num-units"]))
        touching = [properties.get_node(f"{of}/unit[{k}]/WOW") for k in units for of in ("gear", "contact")]
        self._units = [node for node in touching if node is not None]  # wheels, nose, tail, wing tips
        self._home_alt_m = home_alt_m
        self._origin_ned = np.zeros(3)

    def put(self, row: Any) -> None:
        """Puts it where a row of a body's `State` has it, its engine running; the ground is as far below as there."""
        self._origin_ned[:] = put_at(self._sim, row, self._home_alt_m)
        self._stand_on(float(row["pos_ned"][2]) + float(row["height_agl_m"]))
        self._sim["ic/terrain-elevation-ft"] = self._ground.get_double_value()
        self._sim.run_ic()
        self._sim["propulsion/set-running"] = -1
        self._sim["fcs/mixture-cmd-norm"] = 1.0

    def step(self, row: Any, command: list[float], wind_ned: list[float]) -> None:
        """Moves it by a tick of 4 ms and writes the row.

        Args:
            row: of a body's `State`, as the last step left it, `height_agl_m` included.
            command: aileron, elevator, throttle, rudder, nose wheel, brake; positive: roll right, pitch up, yaw right.
            wind_ned: [m/s]
        """
        for node, of, sign in self._controls:
            node.set_double_value(sign * command[of])
        for node, speed_m_s in zip(self._wind, wind_ned, strict=True):
            node.set_double_value(speed_m_s / FT_M)
        self._stand_on(float(row["pos_ned"][2]) + float(row["height_agl_m"]))
        self._sim.run()
        self._write(row)

    def stop(self) -> None:
        """Its engine is off for good."""
        self._sim["fcs/mixture-cmd-norm"] = 0.0

    def _stand_on(self, ground_down_m: float) -> None:
        self._ground.set_double_value((self._home_alt_m - ground_down_m) / FT_M)

    def _write(self, row: Any) -> None:
        north, east, up, *rest = (node.get_double_value() for node in self._motion)
        vel_ned = FT_M * np.array(rest[:3])
        roll, pitch, yaw = rest[3:6]
        q = product(quat_of(yaw, pitch), (np.sin(0.5 * roll), 0.0, 0.0, np.cos(0.5 * roll)))
        omega_frd = np.array(rest[6:])
        felt_ned = (vel_ned - row["vel_ned"]) / TICK_S - np.array([0.0, 0.0, GRAVITY_M_S2])
        felt_before = rotated(inverse(row["q_ned_from_frd"].tolist()), felt_ned.tolist())
        felt_after = rotated(inverse(q), felt_ned.tolist())
        row["accel_frd"] = 0.5 * (np.array(felt_before) + np.array(felt_after))  # the body turns meanwhile
        row["gyro_frd"] = 0.5 * (row["omega_frd"] + omega_frd)
        row["pos_ned"] = (
            self._origin_ned[0] + FT_M * north,
            self._origin_ned[1] + FT_M * east,
            self._origin_ned[2] - FT_M * up,
        )
        row["vel_ned"], row["q_ned_from_frd"], row["omega_frd"] = vel_ned, q, omega_frd
        ahead_fps, density, rpm = (node.get_double_value() for node in self._air)
        ahead_m_s = FT_M * ahead_fps
        row["pitot_pa"] = 0.5 * _SLUG_FT3_KG_M3 * density * max(ahead_m_s, 0.0) * ahead_m_s
        row["propeller_rad_s"] = _RPM_RAD_S * rpm
        row["is_on_ground"] = any(node.get_double_value() for node in self._units)
