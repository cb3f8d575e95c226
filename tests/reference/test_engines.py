"""Engines against a fourth-order integration of the same flight, and against each other."""

from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.engines.native import NativeEngine
from tests.reference.engine_flight import apart, flown, integrated

pytest.importorskip("pybullet")
pytest.importorskip("jsbsim")


@pytest.fixture(scope="module")
def reference():
    return integrated()


def engines():
    from sim.engines.bullet import BulletEngine
    from sim.engines.jsbsim_engine import JsbsimEngine

    return {
        "native": NativeEngine,
        "pybullet": BulletEngine,
        "jsbsim": JsbsimEngine,
        "damped": partial(BulletEngine, damping=0.04),
    }


def test_the_flight_is_one_worth_comparing(reference):
    assert np.linalg.norm(reference[-1, :3] - [5.0, 13.0, -33.0]) < 0.3
    tilt = np.degrees(np.arccos(Rotation.from_quat(reference[:, 3:]).as_matrix()[:, 2, 2]))
    assert tilt.max() > 20.0


@pytest.mark.parametrize("name", ["native", "pybullet", "jsbsim"])
def test_an_engine_flies_as_the_equations_say(name, reference):
    off_m, off_deg = apart(flown(engines()[name]), reference)
    assert off_m < 1.5e-3  # half a step of 1 ms, as plain semi-implicit Euler is off, makes 1.9 mm and 0.066 deg
    assert off_deg < 0.02


def test_bullets_own_damping_is_no_air(reference):
    """A control: with what Bullet damps by default the flight is another, and is noticed."""
    off_m, off_deg = apart(flown(engines()["damped"]), reference)
    assert off_m > 0.1
    assert off_deg > 1.0
