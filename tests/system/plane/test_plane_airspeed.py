"""A pitot tube that fails in flight is noticed, told, and survived: the plane lands; the log shows what it was told."""

from math import nan

import numpy as np
import pytest
from pyulog import ULog

from autopilot.ports import AIRSPEED_VALID
from mission.client import CommandRefused
from mission.flight import Flight, FlightConfig
from tests.system.plane.test_plane_modes import airborne, flown

INJECT, AIRSPEED = 420, 8
OK, OFF, STUCK, GARBAGE, WRONG, SLOW, DELAYED, INTERMITTENT = range(8)
FAILING = {"SYS_FAILURE_EN": 1}


async def inject(drone, failure):
    await drone.command(INJECT, float(AIRSPEED), float(failure), 0.0, nan, nan, nan, nan)


@pytest.mark.parametrize(
    ("failure", "noticed_s"),
    [(OFF, 2.0), (STUCK, 4.0), (WRONG, 4.0), (INTERMITTENT, 4.0)],
    ids=["off", "stuck", "wrong", "intermittent"],
)
def test_a_tube_that_fails_is_noticed_and_the_plane_lands(failure, noticed_s):
    async def script(drone, flight):
        state = flight.controller.state
        await airborne(drone, 50.0)
        await drone.sleep(30.0)
        await inject(drone, failure)
        await drone.until(lambda: not state.estimate.flags & AIRSPEED_VALID, noticed_s, "noticed")
        await drone.sleep(0.5)
        assert any("Airspeed sensor failed" in text for text in drone.texts)
        for _ in range(20):
            await drone.sleep(1.0)
            assert abs(drone.pos_ned[2] + 50.0) < 15.0
            assert float(np.linalg.norm(flight.rig.rows["truth"]["vel_ned"][0])) > 14.5  # it does not stall
        await drone.return_home()
        await drone.wait_disarmed(300.0)

    flown(script, seconds=600.0, wind_m_s=3.0, seed=70 + failure, parameters=FAILING)


@pytest.mark.parametrize("failure", [GARBAGE, SLOW], ids=["garbage", "slow"])
def test_a_tube_that_is_bad_but_right_on_the_whole_does_not_end_it(failure):
    async def script(drone, flight):
        await airborne(drone, 50.0)
        await inject(drone, failure)
        await drone.sleep(30.0)
        assert abs(drone.pos_ned[2] + 50.0) < 15.0
        await drone.return_home()
        await drone.wait_disarmed(300.0)

    flown(script, seconds=600.0, seed=80, parameters=FAILING)


def test_a_sound_tube_is_not_doubted_in_wind_and_turns():
    async def script(drone, flight):
        state = flight.controller.state
        await airborne(drone, 50.0)
        for _ in range(120):
            await drone.sleep(1.0)
            assert state.estimate.flags & AIRSPEED_VALID

    flown(script, wind_m_s=10.0, seed=81)


def test_a_repaired_tube_is_used_again():
    async def script(drone, flight):
        state = flight.controller.state
        await airborne(drone, 50.0)
        await drone.sleep(10.0)
        await inject(drone, STUCK)
        await drone.until(lambda: not state.estimate.flags & AIRSPEED_VALID, 4.0, "noticed")
        await inject(drone, OK)
        await drone.sleep(8.0)
        assert not state.estimate.flags & AIRSPEED_VALID  # ASPD_FS_T_START
        await drone.until(lambda: state.estimate.flags & AIRSPEED_VALID, 5.0, "used again")

    flown(script, seed=82, parameters=FAILING)


def test_what_has_no_tube_refuses_its_failure():
    flight = Flight(FlightConfig(parameters=FAILING))

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        with pytest.raises(CommandRefused, match="no airspeed"):
            await inject(drone, STUCK)

    running = flight.fly(script, seconds=30.0)
    flight.close()
    assert running.error is None, running.error


def test_the_log_has_what_the_tube_says_and_what_is_believed(tmp_path):
    flight = Flight(FlightConfig(airframe="plane", wind_m_s=6.0, wind_from_deg=0.0), folder=tmp_path)
    flight.run(lambda flight: flight.time_us >= 3e6)  # it stands with its nose in the wind
    flight.rig.rows["faults"]["airspeed"][0] = (1, 0.0)  # off
    flight.run(lambda flight: flight.time_us >= 6e6)
    flight.close()
    topics = {data.name: data.data for data in ULog(str(tmp_path / "flight.ulg")).data_list}
    measured, believed = topics["airspeed"], topics["airspeed_validated"]
    assert np.mean(measured["indicated_airspeed_m_s"]) == pytest.approx(6.0, abs=2.0)
    ratio = measured["true_airspeed_m_s"] / measured["indicated_airspeed_m_s"]
    assert ratio == pytest.approx(1.024, abs=2e-3)  # 488 m above the sea
    is_late = believed["timestamp"] > 4.5e6
    assert np.isnan(believed["indicated_airspeed_m_s"][is_late]).all()
    assert (believed["selected_airspeed_index"][is_late] == -1).all()
    assert (believed["airspeed_sensor_measurement_valid"][believed["timestamp"] < 2.5e6][25:] == 1).all()
