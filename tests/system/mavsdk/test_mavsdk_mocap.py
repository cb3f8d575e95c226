"""MAVSDK 4.1's Mocap plugin: a vehicle without GNSS that flies by each of the four messages it sends."""

from math import atan2, nan

import numpy as np
import pytest
from mavsdk.plugins.action import Action
from mavsdk.plugins.mocap import (
    AngleBody,
    AngularVelocityBody,
    AttitudePositionMocap,
    Covariance,
    Mocap,
    Odometry,
    PositionBody,
    Quaternion,
    SpeedBody,
    SpeedNed,
    VisionPositionEstimate,
    VisionSpeedEstimate,
)
from mavsdk.plugins.telemetry import Telemetry

from mission.flight import FlightConfig
from sim.faults import set_fault
from tests.system.raw_vehicle import OPEN, RawVehicle

NOISE_M = 0.01
UNKNOWN = Covariance([nan])
POS, HEIGHT, VEL, YAW = 1, 2, 4, 8
MAG_NONE = 5


class Cameras:
    """What a motion capture program sends, each time it is asked whether something is so."""

    def __init__(self, vehicle):
        self.mocap = vehicle.plugin(Mocap)
        self.body = vehicle.flight.rig.rows["truth"]
        self.rng = np.random.default_rng(5)

    def position(self):
        x, y, z = (float(value) for value in self.body["pos_ned"][0] + self.rng.normal(0.0, NOISE_M, 3))
        return PositionBody(x, y, z)

    def attitude(self):
        x, y, z, w = (float(value) for value in self.body["q_ned_from_frd"][0])
        return Quaternion(w, x, y, z)

    def yaw(self):
        q = self.attitude()
        return atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y**2 + q.z**2))

    def send_vision(self):
        angle = AngleBody(0.0, 0.0, self.yaw())
        self.mocap.set_vision_position_estimate(VisionPositionEstimate(0, self.position(), angle, UNKNOWN, 0))

    def send_speed(self):
        north, east, down = (float(value) for value in self.body["vel_ned"][0])
        self.mocap.set_vision_speed_estimate(VisionSpeedEstimate(0, SpeedNed(north, east, down), UNKNOWN, 0))

    def send_vision_and_speed(self):
        self.send_vision()
        self.send_speed()

    def send_mocap(self):
        self.mocap.set_attitude_position_mocap(AttitudePositionMocap(0, self.attitude(), self.position(), UNKNOWN))

    def send_odometry(self):
        q = self.attitude()
        u, v = -np.array([q.x, q.y, q.z]), self.body["vel_ned"][0].astype(float)
        t = 2.0 * np.cross(u, v)
        x, y, z = (float(value) for value in v + q.w * t + np.cross(u, t))
        self.mocap.set_odometry(
            Odometry(
                0,
                Odometry.MavFrame.MOCAP_NED,
                self.position(),
                q,
                SpeedBody(x, y, z),
                AngularVelocityBody(0.0, 0.0, 0.0),
                UNKNOWN,
                UNKNOWN,
                0,
                Odometry.MavEstimatorType.MOCAP,
                90,
            )
        )


@pytest.mark.parametrize(
    ("name", "used"),
    [
        ("send_odometry", POS | HEIGHT | VEL | YAW),
        pytest.param("send_vision_and_speed", POS | HEIGHT | VEL, marks=pytest.mark.slow),
        pytest.param("send_mocap", POS | HEIGHT | YAW, marks=pytest.mark.slow),
    ],
)
def test_flies_without_gnss_by(name, used):
    params = {"EKF2_EV_CTRL": used, "EKF2_GPS_CTRL": 0, "EKF2_MAG_TYPE": MAG_NONE if used & YAW else 0}
    with RawVehicle(FlightConfig(world=OPEN, seed=2, parameters=params)) as vehicle:
        set_fault(vehicle.flight.rig.arrays.faults.numpy()[0], "gnss", "off")
        cameras, telemetry, action = Cameras(vehicle), vehicle.plugin(Telemetry), vehicle.plugin(Action)
        send = getattr(cameras, name)

        def until(condition, seconds, what):
            vehicle.until(lambda: (send(), condition())[1], seconds, what)

        until(lambda: vehicle.state.is_ready_to_arm, 30.0, "ready")
        until(lambda: telemetry.health().is_local_position_ok, 10.0, "told that the position is good")
        action.set_takeoff_altitude(3.0)
        action.arm()
        action.takeoff()
        until(lambda: abs(cameras.body["pos_ned"][0][2] + 3.2) < 0.3, 40.0, "at the height")
        end_us = vehicle.flight.time_us + 5_000_000
        until(lambda: vehicle.flight.time_us > end_us, 6.0, "holding")
        error = np.array(vehicle.state.estimate.pos_ned) - cameras.body["pos_ned"][0]
        action.land()
        until(lambda: not vehicle.state.is_armed, 40.0, "landed")
    assert np.linalg.norm(error) < 0.1
    assert np.hypot(*cameras.body["pos_ned"][0][:2]) < 0.3
    texts = vehicle.flight.drone.texts
    assert not [text for text in texts if "ost" in text or "External" in text], texts
