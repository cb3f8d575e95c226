"""Visual odometry against the simulator's truth: pictures of woods, with noise, along a path that turns and leans."""

import numpy as np
import pytest
import warp as wp

from common.attitude import product, quat_of_roll_pitch_yaw, rotated
from policies.companion.odometry.visual_odometry import VisualOdometry
from policies.companion.senses.poses import Pose
from policies.tasks.follow_me.observe import IMAGE_SIZE, LENS_FRD, camera_mount, pack_images
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.sensors.fast_camera.fast_camera import QuickCamera
from sim.walking_owner import Owner
from sim.world.world import build_world

COUNT, PERIOD_S = 60, 0.1
HEIGHT_M = 1.9
AWAY_NED = (500.0, 500.0, 0.0)
NOISE = {"read_std": 2.5, "shot_std": 4.5, "depth_std_fraction": 0.02}  # as the onboard camera has it


@pytest.fixture(scope="module")
def world():
    return build_world(FOLLOW_WORLD.model_copy(update={"seed": 3_942_101, "trees_per_ha": 200.0}))


def path(world, speed):
    """Poses ten times a second: a bend at a speed [m/s], the nose swinging, leaning as it goes."""
    time_s = PERIOD_S * np.arange(COUNT)
    heading = 0.4 * np.sin(0.5 * time_s)
    north = np.cumsum(speed * PERIOD_S * np.cos(heading)) + 4.0
    east = np.cumsum(speed * PERIOD_S * np.sin(heading))
    down = [-world.terrain.height(float(n), float(e)) - HEIGHT_M for n, e in zip(north, east, strict=True)]
    down = np.convolve(np.pad(down, 5, "edge"), np.ones(11) / 11.0, "valid")
    places = np.stack([north, east, down], -1)
    turns = zip(0.05 * np.sin(2.0 * time_s), 0.08 * np.cos(1.5 * time_s), 0.6 * np.sin(time_s), strict=True)
    return [
        Pose(round(1e6 * t), tuple(map(float, place)), quat_of_roll_pitch_yaw(*map(float, turn)))
        for t, place, turn in zip(time_s, places, turns, strict=True)
    ]


def pictures(world, poses, walkers, **optics):
    """What the companion would get of each pose, somebody standing at a place [m, ned] in each."""
    people = Owner(world, [(0.0, 3.0, 0.5)] * len(poses), 5).people
    people.numpy()["pos_ned"] = walkers
    camera = QuickCamera(world, len(poses), width=IMAGE_SIZE, height=IMAGE_SIZE, people=people, has_optics=True)
    lenses, rows = camera.lenses.numpy(), camera.optics.numpy()
    for i, pose in enumerate(poses):
        lenses["pos_ned"][i] = np.array(pose.pos_ned) + rotated(pose.q_ned_from_frd, LENS_FRD)
        lenses["q_ned_from_rdf"][i] = product(pose.q_ned_from_frd, camera_mount())
    for name, value in {**NOISE, **optics}.items():
        rows[name] = value
    rows["seed"] = np.arange(len(poses))
    camera.render()
    images = wp.zeros((*camera.rgb.shape[:3], 4), dtype=wp.uint8)
    everyone = wp.full(len(poses), value=True, dtype=wp.bool)
    wp.launch(pack_images, images.shape[:2], [camera.rgb, camera.depth_m, everyone, images])
    return images.numpy()


def motions(images, poses, people, off=(0.0, 0.0, 0.0)):
    """What is measured, and the truth of the same: (n, 3) each, and the deviations that it tells."""
    odometry = VisualOdometry()
    found, true, std = [], [], []
    for i, (image, pose) in enumerate(zip(images, poses, strict=True)):
        flown = (np.array(pose.pos_ned) - poses[max(i - 1, 0)].pos_ned) / PERIOD_S
        motion = odometry.see(image, pose, people[i], tuple(flown + off))
        if motion is not None:
            found.append(motion.vel_ned)
            true.append(flown)
            std.append(np.sqrt(np.diag(motion.cov)))
            assert motion.time_us == (pose.time_us + poses[i - 1].time_us) // 2
    return np.array(found), np.array(true), np.array(std)


def beside(poses, ahead_m):
    """Somebody who walks from left to right before the vehicle."""
    walkers = []
    for i, pose in enumerate(poses):
        aside_m = 1.5 * np.sin(1.3 * PERIOD_S * i)
        walkers.append(np.add(pose.pos_ned, (ahead_m, aside_m, HEIGHT_M)))
    return np.array(walkers)


@pytest.mark.parametrize("speed", [0.0, 1.3, 4.0])
def test_velocity_is_that_of_the_simulator(world, speed):
    poses = path(world, speed)
    images = pictures(world, poses, AWAY_NED)
    found, true, std = motions(images, poses, [[]] * COUNT, off=(0.3, -0.3, 0.1))
    assert len(found) >= COUNT - 3
    errors = found - true
    assert np.all(np.sqrt((errors**2).mean(0)) < (0.15, 0.15, 0.08)), np.sqrt((errors**2).mean(0))
    assert np.all(np.abs(errors.mean(0)) < 0.03 + 0.04 * speed), errors.mean(0)
    normalised = np.sqrt(((errors / std) ** 2).mean())
    assert 0.2 < normalised < 1.5, normalised  # it errs by about as much as it tells


def test_somebody_who_walks_before_it_does_not_disturb_it(world):
    poses = path(world, 1.3)
    walkers = beside(poses, 1.6)
    images = pictures(world, poses, walkers)
    assert np.mean(images[:, :, :, 3] != pictures(world, poses, AWAY_NED)[:, :, :, 3]) > 0.03  # is in sight
    known, true, _ = motions(images, poses, [[place] for place in walkers])
    assert np.all(np.sqrt(((known - true) ** 2).mean(0)) < (0.15, 0.15, 0.08))
    unknown, true, _ = motions(images, poses, [[]] * COUNT)
    assert np.all(np.abs((unknown - true).mean(0)) < 0.1)  # nor do they where the detector has missed them


def test_without_depth_nothing_is_measured(world):
    poses = path(world, 1.3)[:10]
    images = pictures(world, poses, AWAY_NED, has_depth_limit=1, depth_max_m=0.0)
    assert len(motions(images, poses, [[]] * COUNT)[0]) == 0


def test_a_picture_that_comes_once_more_is_no_rest(world):
    poses = path(world, 1.3)[:6]
    images = pictures(world, poses, AWAY_NED)
    images[3] = images[2]
    found, true, _ = motions(images[:4], poses[:4], [[]] * 4)
    assert len(found) == 2
    assert np.abs(found - true).max() < 0.5


def test_a_picture_after_a_gap_begins_anew(world):
    poses = path(world, 1.3)[:10]
    images = pictures(world, poses, AWAY_NED)
    odometry = VisualOdometry()
    assert odometry.see(images[0], poses[0], [], (0.0, 0.0, 0.0)) is None
    assert odometry.see(images[9], poses[9], [], (0.0, 0.0, 0.0)) is None
