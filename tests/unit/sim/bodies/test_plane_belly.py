"""A plane without wheels on its belly."""

from math import radians

import numpy as np
import pytest

from common.airframe import AIRFRAME_FOLDER, AirframeError, load_airframe
from sim.bodies.plane_model import plane_model
from tests.unit.sim.plane_fleet import PlaneFleet

GLIDER = load_airframe("easyglider")


def on_belly():
    return PlaneFleet(model=plane_model(GLIDER, 0.0))


def test_it_lies_on_its_belly_and_a_wing_tip():
    fleet = on_belly()
    fleet.fly(30.0, wind_ned=(0.0, 1.0, 0.0))
    row = fleet.state[0]
    assert row["is_on_ground"] == 1
    assert row["pos_ned"][:2] == pytest.approx((0.0, 0.0), abs=0.3)
    x, y, z, w = row["q_ned_from_frd"]
    lean = 2.0 * abs(np.arctan2(np.hypot(x, y), np.hypot(z, w)))
    assert lean < radians(15.0)
    assert np.linalg.norm(row["vel_ned"]) < 0.02


def test_it_slides_to_a_halt_as_coulomb_says():
    fleet = on_belly()
    fleet.fly(1.0)
    fleet.state["vel_ned"][:, 0] = 3.0
    fleet.fly(4.0)
    way_m = fleet.state["pos_ned"][0, 0]
    assert way_m == pytest.approx(3.0**2 / (2.0 * 0.5 * 9.81), rel=0.2)  # lift and drag are small at such a speed
    assert not fleet.state["is_crashed"][0]


@pytest.mark.parametrize(
    ("removed", "why"),
    [("[belly]", "either"), ("[throw]", "needs a")],
)
def test_a_plane_without_wheels_needs_belly_and_throw(tmp_path, removed, why):
    text = (AIRFRAME_FOLDER / "easyglider.toml").read_text(encoding="utf-8")
    begin = text.index(removed)
    path = tmp_path / "odd.toml"
    path.write_text(text[:begin] + text[text.index("[", begin + 1) :], encoding="utf-8")
    with pytest.raises(AirframeError, match=why):
        load_airframe(str(path))
