"""The flight log and the history: every topic says what the kernel rows said."""

from itertools import groupby

import numpy as np
import pytest
from pyulog import ULog

from autopilot.interface.item_lists import MissionItem
from autopilot.vehicles.multirotor.modes import MULTIROTOR_MODES
from common.geodesy import DEFAULT_HOME, geodetic_from_ned
from mission.flight import Flight, FlightConfig
from mission.log.euler_angles import wxyz
from mission.log.log_topics import TOPICS
from sim.faults import set_fault
from sim.world.world import WorldConfig

SECONDS = 14.0
FRAMES = round(SECONDS * 50)
HOLD_NAV_STATE, TAKEOFF_NAV_STATE = 4, 17


class Flown:
    """A short flight with noise, recorded, and the rows as they were after its last frame."""

    def __init__(self, folder):
        flight = Flight(FlightConfig(seed=2, wind_m_s=3.0), folder=folder)
        flight.fly(self._climb, seconds=SECONDS)
        arrays = flight.rig.arrays
        self.body = flight.rig.truth.numpy()[0].copy()
        self.samples = arrays.sensors.numpy()["samples"][0].copy()
        self.estimate = arrays.autopilot.ekf.rows.numpy()["estimate"][0].copy()
        self.actuators = arrays.autopilot.control.numpy()["actuators"][0].copy()
        self.origin = flight.controller.state.origin
        self.history = flight.close()
        self.band = flight.recorder.innovations_in_band()
        self.log = ULog(str(folder / "flight.ulg"))
        self.topics = {data.name: data.data for data in self.log.data_list}

    @staticmethod
    async def _climb(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)
        await drone.goto_ned(8.0, 3.0, -5.0)
        await drone.sleep(60.0)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return Flown(tmp_path_factory.mktemp("flight"))


def last(topic, names):
    return [topic[name][-1] for name in names.split()]


def test_every_topic_has_rows(flown):
    names = {topic.name for topic in TOPICS}
    assert names - set(flown.topics) == {"wheel_encoders", "airspeed", "airspeed_validated"}  # it has neither
    for name in names & set(flown.topics):
        assert len(flown.topics[name]["timestamp"]) > 0, name


def test_each_frame_is_logged_once(flown):
    for name in ("vehicle_attitude", "vehicle_local_position_groundtruth", "actuator_motors"):
        np.testing.assert_array_equal(flown.topics[name]["timestamp"], np.arange(1, FRAMES + 1) * 20_000)


def test_every_imu_sample_is_logged_once(flown):
    imu = flown.topics["sensor_combined"]
    np.testing.assert_array_equal(np.diff(imu["timestamp"]), 4_000)
    assert imu["timestamp"][-1] == flown.samples["imu"]["time_us"]
    assert last(imu, "gyro_rad[0] gyro_rad[1] gyro_rad[2]") == flown.samples["imu"]["gyro_frd"].tolist()
    assert (imu["gyro_integral_dt"] == 4_000).all()


@pytest.mark.parametrize(
    ("topic", "sensor", "rate_hz"),
    [("vehicle_gps_position", "gnss", 5.0), ("vehicle_magnetometer", "mag", None), ("sensor_baro", "baro", None)],
)
def test_each_sample_of_a_slower_sensor_is_logged_once(flown, topic, sensor, rate_hz):
    times_us = flown.topics[topic]["timestamp_sample"].astype(np.int64)
    assert (np.diff(times_us) > 0).all()
    assert times_us[-1] == flown.samples[sensor]["time_us"]
    if rate_hz is not None:
        assert np.median(np.diff(times_us)) == pytest.approx(1e6 / rate_hz)


def test_truth_and_estimate_are_the_rows(flown):
    truth, estimate = (flown.topics[f"vehicle_local_position{suffix}"] for suffix in ("_groundtruth", ""))
    assert last(truth, "x y z") == flown.body["pos_ned"].tolist()
    assert last(truth, "vx vy vz") == flown.body["vel_ned"].tolist()
    assert last(estimate, "x y z") == flown.estimate["pos_ned"].tolist()
    assert last(estimate, "eph epv") == [flown.estimate["pos_h_std"], flown.estimate["pos_v_std"]]
    assert estimate["xy_valid"][-1] == 1
    assert estimate["xy_valid"][0] == 0  # at power-on


def test_yaw_estimator_is_logged_and_finds_the_heading(flown):
    logged = flown.topics["yaw_estimator_status"]
    assert sum(logged[f"weight[{k}]"][-1] for k in range(5)) == pytest.approx(1.0, abs=1e-4)
    assert not logged["yaw_composite_valid"][0]
    assert logged["yaw_composite_valid"][-1]
    heading = flown.topics["vehicle_local_position_groundtruth"]["heading"][-1]
    error = (logged["yaw_composite"][-1] - heading + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(error) < 4.0 * np.sqrt(logged["yaw_variance"][-1])


def test_quaternions_are_logged_with_the_scalar_first(flown):
    attitude = flown.topics["vehicle_attitude_groundtruth"]
    x, y, z, w = flown.body["q_ned_from_frd"].tolist()
    assert last(attitude, "q[0] q[1] q[2] q[3]") == [w, x, y, z]
    assert wxyz(np.array([[1.0, 2.0, 3.0, 4.0]])).tolist() == [[4.0, 1.0, 2.0, 3.0]]


def test_motors_and_setpoints_are_the_rows(flown):
    motors = flown.topics["actuator_motors"]
    assert last(motors, "control[0] control[3]") == flown.actuators["command"][[0, 3]].tolist()
    assert np.isnan(motors["control[11]"]).all()
    setpoint = flown.topics["vehicle_local_position_setpoint"]
    assert last(setpoint, "x y z") == flown.actuators["traj_pos_ned"].tolist()


def test_global_position_is_the_local_one_seen_from_home(flown):
    latitude, longitude, altitude = geodetic_from_ned(*flown.estimate["pos_ned"].tolist(), flown.origin)
    place = flown.topics["vehicle_global_position"]
    assert last(place, "lat lon") == pytest.approx([latitude, longitude], abs=1e-9)
    assert place["alt"][-1] == pytest.approx(altitude, abs=1e-3)
    gnss = flown.topics["vehicle_gps_position"]
    assert gnss["latitude_deg"][0] == pytest.approx(DEFAULT_HOME.lat_deg, abs=1e-4)
    assert gnss["altitude_msl_m"][0] == pytest.approx(DEFAULT_HOME.alt_m, abs=5.0)


def test_status_follows_mode_and_arming(flown):
    status = flown.topics["vehicle_status"]
    assert set(status["nav_state"]) <= {spec.nav_state for spec in MULTIROTOR_MODES.values()}
    assert {HOLD_NAV_STATE, TAKEOFF_NAV_STATE} <= set(status["nav_state"])
    assert (status["arming_state"][0], status["arming_state"][-1]) == (1, 2)
    assert status["pre_flight_checks_pass"][[0, -1]].tolist() == [0, 1]
    armed_us = int(flown.history.time_us[np.argmax(flown.history.is_armed)])
    assert armed_us in status["timestamp"]  # the change itself is logged
    assert status["armed_time"].tolist() == np.where(status["arming_state"] == 2, armed_us, 0).tolist()
    landed = flown.topics["vehicle_land_detected"]
    assert landed["landed"][[0, -1]].tolist() == [1, 0]
    assert landed["ground_contact"][[0, -1]].tolist() == [1, 0]


def test_battery_is_logged_with_what_the_vehicle_thinks_is_left(flown):
    battery = flown.topics["battery_status"]
    assert battery["voltage_v"][-1] == flown.samples["battery"]["voltage_v"]
    assert battery["remaining"][-1] == pytest.approx(flown.history.battery_remaining[-1], abs=1e-3)
    assert battery["discharged_mah"][-1] > battery["discharged_mah"][10] > 0.0


def test_mission_result_follows_the_mission_to_its_end(tmp_path):
    here = (0.0, 0.0, 0.0, float("nan"))
    plan = [MissionItem(0, 6, 22, here, 0.0, 0.0, 3.0), MissionItem(1, 6, 21, here, 0.0, 0.0, 0.0)]

    async def fly(drone):
        await drone.wait_ready()
        await drone.upload(plan)
        await drone.sleep(1.0)
        await drone.arm()
        await drone.start_mission()
        await drone.wait_disarmed()

    flight = Flight(FlightConfig(noise=0.0), folder=tmp_path)
    assert flight.fly(fly, seconds=60.0).error is None
    flight.close()
    (result,) = ULog(str(tmp_path / "flight.ulg"), ["mission_result"]).data_list
    columns = (result.data[name].tolist() for name in "seq_total seq_current seq_reached valid finished".split())
    assert [row for row, _ in groupby(zip(*columns, strict=True))] == [
        (0, 0, -1, 0, 0),
        (2, 0, -1, 1, 0),
        (2, 1, 0, 1, 0),
        (2, 1, 1, 1, 1),
    ]


def test_saturated_axes_of_the_inertial_sensors_are_marked(tmp_path):
    flight = Flight(FlightConfig(), folder=tmp_path)
    flight.fly(lambda drone: drone.sleep(0.5))
    set_fault(flight.rig.arrays.faults.numpy()[0], "accel", "biased", 240.0)  # up to 24 g, x and y; z is at -1 g
    flight.fly(lambda drone: drone.sleep(0.5))
    set_fault(flight.rig.arrays.faults.numpy()[0], "gyro", "biased", -40.0)
    flight.fly(lambda drone: drone.sleep(0.5))
    flight.close()
    (imu,) = ULog(str(tmp_path / "flight.ulg"), ["sensor_combined"]).data_list
    assert set(imu.data["accelerometer_clipping"].tolist()) == {0, 3}
    assert imu.data["accelerometer_clipping"][[0, -1]].tolist() == [0, 3]
    assert imu.data["gyro_clipping"][[0, -1]].tolist() == [0, 7]


def test_parameters_and_texts_are_in_the_log(flown):
    assert flown.log.initial_parameters["MIS_TAKEOFF_ALT"] == 2.5
    assert flown.log.initial_parameters["SYS_AUTOSTART"] == 4001
    assert [message.message for message in flown.log.logged_messages] == ["Armed"]
    assert flown.log.msg_info_dict["airframe"] == "x500"


def test_history_is_the_same_flight(flown):
    history = flown.history
    assert history.time_us.tolist() == (np.arange(1, FRAMES + 1) * 20_000).tolist()
    assert history.pos_ned_true[-1].tolist() == flown.body["pos_ned"].tolist()
    assert history.q_est.shape == (FRAMES, 4)
    assert history.is_armed.dtype == bool
    assert not history.is_armed[0]
    assert history.is_armed[-1]


def test_innovations_are_counted_per_source(flown):
    assert set(flown.band) == {"gnss_pos", "gnss_vel", "gnss_height", "baro", "mag", "range"}
    assert all(0.8 < share <= 1.0 for share in flown.band.values())


def test_a_flight_without_a_folder_writes_nothing_and_still_has_a_history(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flight = Flight(FlightConfig())
    flight.fly(lambda drone: drone.sleep(1.5))
    assert 75 <= len(flight.close().time_us) <= 76
    assert list(tmp_path.iterdir()) == []


def test_a_flight_of_no_frames_has_an_empty_history_and_a_whole_log(tmp_path):
    assert len(Flight(FlightConfig(), folder=tmp_path).close().time_us) == 0
    assert ULog(str(tmp_path / "flight.ulg")).data_list == []


def test_log_of_an_idle_vehicle_thins_out_until_somebody_listens(tmp_path):
    flight = Flight(FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0)), folder=tmp_path)

    def until_s(seconds):
        flight.run(lambda f: f.time_us >= seconds * 1_000_000)

    until_s(130.0)
    records = []
    listener = records.append
    flight.recorder.listen(listener)
    until_s(132.0)
    flight.recorder.stop_listening(listener)
    until_s(140.0)
    flight.close()
    topics = {data.name: data.data["timestamp"] * 1e-6 for data in ULog(str(tmp_path / "flight.ulg")).data_list}
    assert records
    for name, rate_hz in {"vehicle_attitude": 50, "sensor_combined": 250}.items():
        assert np.count_nonzero(topics[name] <= 120.0) == pytest.approx(120 * rate_hz, abs=5)
        assert np.count_nonzero((topics[name] > 130.02) & (topics[name] <= 131.98)) == pytest.approx(
            1.96 * rate_hz, abs=5
        )
    assert topics["vehicle_attitude"][-8:].tolist() == list(range(133, 141))
    assert topics["sensor_combined"][-1] < 132.1
    assert np.count_nonzero(topics["vehicle_gps_position"] > 132.1) == 8  # the newest of each second
    assert np.diff(topics["vehicle_status"]).max() <= 0.5 + 1e-9


def test_log_of_a_long_flight_goes_on_in_parts_that_clients_can_download(tmp_path, monkeypatch):
    monkeypatch.setattr("common.logs.log_file.PART_BYTES_MAX", 400_000)
    flight = Flight(FlightConfig(world=WorldConfig(size_m=64.0, trees_per_ha=0.0)), folder=tmp_path)
    flight.fly(lambda drone: drone.sleep(15.0))
    stored = flight.host.logs
    listed = {log.name: log.size for log in stored.logs()}
    assert list(listed) == ["flight.ulg", "flight-2.ulg", "flight-3.ulg"]
    for name, size in listed.items():
        (tmp_path / f"copy-{name}").write_bytes(stored.read(name, 0, size))
    times = [ULog(str(tmp_path / f"copy-{name}")).get_dataset("vehicle_attitude").data["timestamp"] for name in listed]
    np.testing.assert_array_equal(np.concatenate(times), np.arange(1, len(np.concatenate(times)) + 1) * 20_000)
    flight.close()


def test_log_has_the_same_bytes_whether_each_second_is_written_when_it_ends_or_five_at_once(tmp_path):
    def logged(name, is_live):
        folder = tmp_path / name
        folder.mkdir()
        flight = Flight(FlightConfig(seed=2, world=WorldConfig(size_m=64.0, trees_per_ha=0.0)), folder=folder)
        flight.recorder.is_live = is_live
        for frame in range(1, 660):
            flight.frame()
            if frame in (270, 333):
                flight.params.set("MPC_XY_CRUISE", 5.0 + frame / 1000.0)
        flight.close()
        return (folder / "flight.ulg").read_bytes()

    assert logged("live", is_live=True) == logged("fast", is_live=False)
