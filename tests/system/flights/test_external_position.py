"""Flights by motion capture and visual odometry alone: no GNSS, positions from the true state plus noise."""

from math import atan2, cos, nan, sin

import numpy as np

from autopilot.mavlink.wire.convert import wxyz_from_quat
from mission.flight import Flight, FlightConfig
from sim.faults import set_fault
from sim.world.world import WorldConfig

POS, HEIGHT, VEL, YAW = 1, 2, 4, 8  # EKF2_EV_CTRL
PERIOD_S = 1.0 / 30.0
NOISE_M = 0.01
UNKNOWN = (nan,) * 21
MAG_NONE = 5
REBOOT = 246  # MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
OPEN = WorldConfig(trees_per_ha=0.0, hill_height_m=0.0)


class Hall:
    """A vehicle without GNSS among cameras that see it.

    Args:
        params: of the vehicle.
    """

    def __init__(self, **params):
        self.flight = Flight(FlightConfig(seed=3, world=OPEN, parameters={"EKF2_EV_CTRL": POS | HEIGHT, **params}))
        self.body = self.flight.rig.rows["truth"]
        set_fault(self.flight.rig.arrays.faults.numpy()[0], "gnss", "off")
        self.rng = np.random.default_rng(7)
        self.is_seen = True
        self.offset_ned = np.zeros(3)  # of the cameras' origin
        self.reset_counter = 0
        self.send = self.position

    @property
    def pos_ned(self):
        return self.body["pos_ned"][0].astype(float)

    @property
    def yaw(self):
        x, y, z, w = self.body["q_ned_from_frd"][0].astype(float)
        return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    @property
    def estimate(self):
        return self.flight.controller.state.estimate

    def noisy(self, scale=NOISE_M):
        return self.rng.normal(0.0, scale, 3)

    def position(self, drone):
        x, y, z = self.pos_ned + self.offset_ned + self.noisy()
        yaw = self.yaw + self.rng.normal(0.0, 0.01)
        drone.send(
            "VISION_POSITION_ESTIMATE", usec=0, x=x, y=y, z=z, roll=0.0, pitch=0.0, yaw=yaw, covariance=UNKNOWN,
            reset_counter=self.reset_counter,
        )  # fmt: skip

    def odometry(self, drone, frame=1, turned=0.0):
        """Position, velocity along the body, attitude, in a frame that is turned about down."""
        x, y, z, w = self.body["q_ned_from_frd"][0].astype(float)
        c, s = cos(0.5 * turned), -sin(0.5 * turned)
        q = (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)
        vel_frd = _rotated_back((x, y, z, w), self.body["vel_ned"][0].astype(float)) + self.noisy(0.02)
        north, east, down = self.pos_ned + self.noisy()
        pos = (cos(turned) * north + sin(turned) * east, cos(turned) * east - sin(turned) * north, down)
        drone.send(
            "ODOMETRY", time_usec=0, frame_id=frame, child_frame_id=12, x=pos[0], y=pos[1], z=pos[2],
            q=wxyz_from_quat(q), vx=vel_frd[0], vy=vel_frd[1], vz=vel_frd[2], rollspeed=nan, pitchspeed=nan,
            yawspeed=nan, pose_covariance=UNKNOWN, velocity_covariance=UNKNOWN, reset_counter=self.reset_counter,
            estimator_type=6, quality=90,
        )  # fmt: skip

    async def watch(self, drone):
        while True:
            if self.is_seen:
                self.send(drone)
            await drone.sleep(PERIOD_S)

    def fly(self, script, seconds=300.0):
        self.flight.drone.start(self.watch(self.flight.drone))
        running = self.flight.fly(script, seconds=seconds)
        if running.error is not None:
            raise running.error
        assert running.is_done
        return self


def _rotated_back(q, v):
    u, w = -np.array(q[:3]), q[3]
    t = 2.0 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


async def square(drone, hall, worst):
    """Take-off, the corners of a 5 m square, a hold at each of them, landing."""
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(3.0)
    for north, east in ((5.0, 0.0), (5.0, 5.0), (0.0, 5.0), (0.0, 0.0)):
        await drone.goto_ned(north, east, -3.0, acceptance_m=0.2)
        await drone.sleep(3.0)
        worst.append(float(np.hypot(hall.pos_ned[0] - north, hall.pos_ned[1] - east)))
    await drone.land()


def flown_square(hall):
    worst = []
    hall.fly(lambda drone: square(drone, hall, worst))
    hall.flight.close()
    return max(worst)


def test_square_by_motion_capture():
    hall = Hall()
    assert flown_square(hall) < 0.3
    assert not any("ost" in text for text in hall.flight.drone.texts), hall.flight.drone.texts


def test_square_by_odometry_in_a_frame_without_north():
    hall = Hall(EKF2_EV_CTRL=POS | HEIGHT | VEL)
    hall.send = lambda drone: hall.odometry(drone, frame=20, turned=0.7)
    assert flown_square(hall) < 0.3


def test_heading_by_odometry_without_magnetometer():
    hall = Hall(EKF2_EV_CTRL=POS | HEIGHT | VEL | YAW, EKF2_MAG_TYPE=MAG_NONE)
    hall.send = hall.odometry
    errors = []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(3.0)
        for yaw in (1.0, 2.5, -2.0):
            await drone.goto_ned(2.0, 0.0, -3.0, yaw_rad=yaw)
            await drone.sleep(6.0)
            errors.append(abs(np.degrees(_wrapped(hall.yaw - yaw))))
        await drone.land()

    hall.fly(script)
    hall.flight.close()
    assert max(errors) < 3.0, errors


def test_loss_of_motion_capture_leads_to_a_landing():
    hall = Hall()

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(3.0)
        hall.is_seen = False
        await drone.wait_disarmed()

    hall.fly(script)
    hall.flight.close()
    assert any("Position lost: land" in text for text in hall.flight.drone.texts), hall.flight.drone.texts
    assert not hall.body["is_crashed"][0]


def test_reset_of_the_client_moves_the_estimate_and_not_the_vehicle():
    hall = Hall()
    moved = []

    async def script(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(3.0)
        await drone.sleep(3.0)
        before = hall.pos_ned
        hall.offset_ned = np.array([4.0, -3.0, 0.0])
        hall.reset_counter = 1
        for _ in range(10):
            await drone.sleep(0.5)
            moved.append(np.linalg.norm(hall.pos_ned - before))
        error = np.array(hall.estimate.pos_ned) - hall.pos_ned - hall.offset_ned
        assert np.linalg.norm(error) < 0.1

    hall.fly(script)
    hall.flight.close()
    assert max(moved) < 0.3, moved


def test_position_is_not_ready_while_nobody_sends():
    hall = Hall()
    hall.is_seen = False

    async def script(drone):
        await drone.sleep(15.0)

    hall.fly(script)
    assert "GNSS" in hall.flight.controller.check_arming()[0]
    hall.flight.close()


def test_ready_again_after_a_restart():
    hall = Hall()

    async def script(drone):
        await drone.wait_ready()
        await drone.command(REBOOT, 1.0, name="restart")
        state = hall.flight.controller.state
        await drone.until(lambda: not state.is_ready_to_arm, 5.0, "restarting")
        await drone.until(lambda: state.is_ready_to_arm, 30.0, "ready again")

    hall.fly(script)
    hall.flight.close()
    assert np.linalg.norm(np.array(hall.estimate.pos_ned) - hall.pos_ned) < 0.1


def _wrapped(angle):
    return atan2(sin(angle), cos(angle))
