"""The default gains of the pitch rate have phase to spare at every airspeed flown, whatever the airframe."""

import numpy as np
import pytest

from autopilot.vehicles.plane.defaults import plane_defaults
from common.airframe import load_airframe

DENSITY_KG_M3, DELAY_S = 1.225, 0.008  # two ticks, from gyro to servo
OMEGA = np.logspace(-1, 2.3, 4000)


def pitch_rate_loop(airframe, defaults, airspeed_m_s):
    """The open loop: short period with lift, servo, delay, and the gains as the law scales them."""
    lift, body, wing = airframe.lift, airframe.body, airframe.wing
    s = 1j * OMEGA
    push_n = 0.5 * DENSITY_KG_M3 * airspeed_m_s**2 * wing.area_m2
    arm = push_n * wing.chord_m / body.inertia_yy_kg_m2
    power = -arm * lift.c_m_elevator * airframe.surfaces.elevator_max_rad
    stiffness, damping = -arm * lift.c_m_alpha, -arm * lift.c_m_q * wing.chord_m / (2.0 * airspeed_m_s)
    lifting = push_n * lift.c_l_alpha / (body.mass_kg * airspeed_m_s)
    plane = power * (s + lifting) / (s * s + (damping + lifting) * s + stiffness + damping * lifting)
    servo = np.exp(-s * DELAY_S) / (1.0 + airframe.surfaces.lag_s * s)
    scale = (defaults["FW_AIRSPD_TRIM"] / airspeed_m_s) ** 2
    return scale * (defaults["FW_PR_P"] + defaults["FW_PR_I"] / s) * plane * servo


@pytest.mark.parametrize("speed", ["FW_AIRSPD_MIN", "FW_AIRSPD_TRIM", "FW_AIRSPD_MAX"])
@pytest.mark.parametrize("name", ["plane", "easyglider", "c172"])
def test_the_pitch_rate_loop_keeps_its_distance_from_instability(name, speed):
    airframe = load_airframe(name)
    defaults = plane_defaults(airframe)
    loop = pitch_rate_loop(airframe, defaults, defaults[speed])
    assert np.abs(1.0 / (1.0 + loop)).max() < 1.8  # 33 deg of phase and a factor of 2.2 at least
    assert np.abs(loop[0]) > 2.0  # and slow rates are followed
