"""The present instant of a running flight, as Foxglove is told of it: live rows and the flight controller's state."""

from typing import Any

from common.geodesy import geodetic_from_ned
from mission.flight_base import FlightBase
from mission.foxglove.vehicle_state import Battery, GnssFix, Motion, Person, VehicleState
from mission.view.flight_snapshot import mode_titles

FIX_3D = 3  # fix_type


class FlightStates:
    """Reads a flight.

    Args:
        flight: which; nothing of it is changed.
    """

    def __init__(self, flight: FlightBase) -> None:
        rows = flight.rig.rows
        self._flight = flight
        self._truth: Any = rows["truth"][0]  # live, as those below
        self._ekf: Any = rows["autopilot.ekf.rows"][0]
        self._actuators: Any = rows["autopilot.control"][0]["actuators"]
        self._samples: Any = rows["sensors"][0]["samples"]
        self._titles = mode_titles(flight.airframe)
        names: tuple[str, ...] = self._ekf.dtype.names
        self._aids = [name for name in names if "test_ratio" in (self._ekf.dtype[name].names or ())]

    def now(self) -> VehicleState:
        """This frame's."""
        flight = self._flight
        state = flight.controller.state
        truth, estimate, actuators = self._truth, self._ekf["estimate"], self._actuators
        battery = self._samples["battery"]
        obstacles = state.obstacles
        return VehicleState(
            time_us=flight.time_us,
            origin=state.origin,
            true=_motion(truth),
            est=_motion(estimate) if estimate["time_us"] > 0 else None,
            setpoint=_setpoint(actuators) if state.is_armed else None,
            outputs=actuators["command"][: len(state.outputs) or None].tolist(),
            test_ratios={name: float(self._ekf[name]["test_ratio"]) for name in self._aids if self._is_judged(name)},
            battery=Battery(float(battery["voltage_v"]), float(battery["current_a"]), state.battery_remaining),
            gnss=self._gnss(),
            mode=self._titles.get(int(state.mode), ""),
            is_armed=bool(state.is_armed),
            goal_ned=state.goal_ned,
            owner=self._owner(),
            ring_m=() if obstacles is None else obstacles.body_m or (),
            ring_time_us=0 if obstacles is None else obstacles.sensed_us,
        )

    def _is_judged(self, aid: str) -> bool:
        return bool(self._ekf[aid]["judged_time_us"] > 0)

    def _gnss(self) -> GnssFix | None:
        sample = self._samples["gnss"]
        if sample["fix_type"] < FIX_3D:
            return None
        north, east, down = sample["pos_ned"].tolist()
        point = geodetic_from_ned(north, east, down, self._flight.controller.state.origin)
        return GnssFix(int(sample["time_us"]), *point, float(sample["pos_h_std"]), float(sample["pos_v_std"]))

    def _owner(self) -> Person | None:
        if self._flight.owner is None:
            return None
        row = self._flight.owner.people.numpy()[0]
        return Person(row["pos_ned"].tolist(), float(row["heading_rad"]), float(row["stature_m"]))


def _motion(row: Any) -> Motion:
    """Of a Truth or an Estimate."""
    names = ("pos_ned", "vel_ned", "q_ned_from_frd", "omega_frd")
    return Motion(*(row[name].tolist() for name in names))


def _setpoint(row: Any) -> Motion:
    names = ("traj_pos_ned", "traj_vel_ned", "q_sp_ned_from_frd", "omega_sp_frd")
    return Motion(*(row[name].tolist() for name in names))
