"""A multirotor that stands on another vehicle rides with it, within Coulomb's friction and not beyond."""

from functools import partial

import numpy as np
import pytest

from common.geodesy import GRAVITY_M_S2
from tests.unit.sim.test_collisions import Met, stepped_by

FRICTION = 0.7
TICK_S = 0.004
DRIVING, STANDING = 1, 0


class Carried(Met):
    """A ugv that drives as it is told, and an x500 that is let down on it."""

    def __init__(self, engine="native", off_ne_m=(0.0, 0.0)):
        super().__init__(("x500", "ugv"), apart_m=5.0, engine=engine)
        self.pos = np.array([5.0, 0.0, 0.0])
        self.pos[2] = self.truth(DRIVING)["pos_ned"][2]
        self.vel = np.zeros(3)
        self.top_m = float(self.rigs[DRIVING].rows["model"][0]["hull_top_m"]) - self.pos[2]
        leg_m = float(self.rigs[STANDING].rows["model"][0]["contact"]["leg_frd"][2])
        self.put(STANDING, (5.0 + off_ne_m[0], off_ne_m[1], -self.top_m - leg_m - 0.002))
        self.drive(0.0, 0.3)

    def _rig(self, i, name, apart_m):
        if i == DRIVING:
            self.make_rig = stepped_by("native")  # which of the two moves the other does not matter here
        return super()._rig(i, name, apart_m)

    def drive(self, accel_m_s2, seconds):
        """Straight north, whatever the wheels say."""
        for _ in range(round(seconds / TICK_S)):
            self.vel[0] += accel_m_s2 * TICK_S
            self.pos += self.vel * TICK_S
            self.put(DRIVING, self.pos, self.vel)
            self.rigs[STANDING].advance(1)

    @property
    def slip_m(self):
        return float(self.truth(STANDING)["pos_ned"][0] - self.pos[0])


@pytest.fixture(params=["native", "pybullet", "jsbsim"])
def carried(request):
    return partial(Carried, request.param)


def test_it_stands_still_on_the_top(carried):
    met = carried()
    truth = met.truth(STANDING)
    assert truth["is_on_ground"]
    assert np.abs(truth["vel_ned"]).max() < 1e-3
    leg_m = float(met.rigs[STANDING].rows["model"][0]["contact"]["leg_frd"][2])
    assert -truth["pos_ned"][2] == pytest.approx(met.top_m + leg_m, abs=3e-3)


def test_it_rides_along_as_long_as_friction_holds(carried):
    met = carried()
    met.drive(0.8 * FRICTION * GRAVITY_M_S2 / 2.0, 0.5)
    met.drive(0.0, 1.0)
    assert abs(met.slip_m) < 0.02  # the legs' bristles yield by millimetres
    assert met.truth(STANDING)["vel_ned"][0] == pytest.approx(met.vel[0], abs=0.01)


def test_it_slides_when_the_brakes_are_harder_than_coulomb_allows(carried):
    met = carried()
    met.drive(2.0, 1.0)
    before = met.truth(STANDING)["vel_ned"].astype(float)
    met.drive(-20.0, 0.1)
    lost, _, sunk = before - met.truth(STANDING)["vel_ned"]
    pressed = GRAVITY_M_S2 * 0.1 + sunk  # it tips over forward, and its middle rises: the feet bear more than it weighs
    assert 0.8 * FRICTION * pressed < lost < FRICTION * pressed  # at first the legs' bristles yield
    assert met.slip_m > 0.02


def test_who_stands_over_the_edge_falls_off(carried):
    met = carried(off_ne_m=(0.0, 0.33))
    met.drive(0.0, 2.0)
    assert -met.truth(STANDING)["pos_ned"][2] < met.top_m


def test_feet_that_are_below_the_top_already_are_not_flung_up(carried):
    met = carried()
    met.put(STANDING, (5.0, 0.0, -met.top_m - 0.15))
    met.drive(0.0, 0.02)
    assert met.truth(STANDING)["vel_ned"][2] > -0.1


def test_the_carrier_drives_on_as_without_a_load():
    """Left out, and said so: it feels nothing of who stands on it."""
    alone, laden = Met(("x500", "ugv"), apart_m=5.0), Carried()
    alone.put(STANDING, (50.0, 0.0, -10.0))
    alone.rigs[DRIVING].advance(100)
    laden.put(DRIVING, laden.pos)
    laden.rigs[DRIVING].advance(100)
    assert laden.truth(DRIVING)["vel_ned"] == pytest.approx(alone.truth(DRIVING)["vel_ned"], abs=1e-3)
    assert not laden.truth(DRIVING)["impact_speed"] > 0.05
