"""A plane's landing, frame by frame: when it is given up, and by whom."""

from math import nan, radians, tan

import pytest

from autopilot.interface.vehicle_state import LandedState, VehicleState, Verdict
from autopilot.navigator.context import NavContext
from autopilot.navigator.setpoint import SetpointPort
from autopilot.params import all_parameters
from autopilot.ports import AIRSPEED_VALID, HEIGHT_VALID, TERRAIN_VALID, Estimate, Setpoint
from autopilot.vehicles.plane.modes.approach import Approach
from autopilot.vehicles.plane.vehicle import PLANE
from common.airframe import load_airframe
from common.params import ParameterTable
from common.records import row_reader
from tests.unit.autopilot.kinematic import ORIGIN, Recorder, rows_of

VALID = HEIGHT_VALID | AIRSPEED_VALID


class Landing:
    """An approach northwards to the origin, of a plane that is put wherever a test wants it."""

    def __init__(self, **params):
        table = ParameterTable(all_parameters(PLANE))
        for name, value in params.items():
            table.set(name, value)
        self.recorder = Recorder()
        self.state = VehicleState(origin=ORIGIN, is_armed=True, landed_state=LandedState.IN_AIR)
        craft = PLANE.craft(load_airframe("plane"))
        self.context = NavContext(self.state, table, self.recorder, SetpointPort(rows_of(Setpoint)), craft)
        self.table = table
        self._estimate = rows_of(Estimate)
        self._read = row_reader(self._estimate, 0, "Estimate")
        self.put(-500.0, 30.0)
        self.approach = Approach(self.context)
        self.approach.start((0.0, 0.0, 0.0), 0.0, is_lined_up=True)

    def put(self, north, height, *, east=0.0, vel_ned=(20.0, 0.0, 1.0), flags=VALID):
        """Puts it there for a frame later."""
        row = self._estimate[0]
        row["pos_ned"], row["vel_ned"], row["flags"] = (north, east, -height), vel_ned, flags
        self.state.time_us += 20_000
        self.state.estimate = self._read()

    def frame(self, *args, **kwargs):
        self.put(*args, **kwargs)
        self.approach.frame()


def test_a_plane_that_stands_in_the_wind_flies_on():
    landing = Landing(FW_LND_FL_SINK=0.0)
    landing.frame(-100.0, 10.0, vel_ned=(-1.0, 0.0, 0.0))
