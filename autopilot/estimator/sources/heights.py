"""Heights together: barometer and GNSS that leave the state on the same side bring it back.

Each of them has a slow error, and what one height sensor says alone is rightly held for that. When both slow errors
are the same, and together larger than such errors are, the state is wrong: something moved it that the filter did not
know of, and no innovation shows it any more. Height is moved then to what both say, weighted by how far each wanders,
and the ground below with it, for the range finder sees no change. Looked at four times a second.
"""

import warp as wp

from autopilot.estimator.health import is_healthy
from autopilot.estimator.params import EstimatorParams
from autopilot.estimator.sources.gnss import gnss_wander_var
from autopilot.estimator.state import GNSS_RING, POS, SLOW, SLOW_BARO, SLOW_COUNT, SLOW_COV, TERRAIN, Ekf, Nominal
from common.kernels import vec24

wp.set_module_options({"enable_backward": False})

_SLOW_GNSS = wp.constant(2)  # slow error of GNSS height
_SIGMA = wp.constant(3.5)  # of what both say together
_LEAST_FRACTION = wp.constant(0.5)  # of the common error, in each of both


@wp.func
def common_error(baro: float, baro_var: float, gnss: float, gnss_var: float) -> tuple[float, float]:
    """[m, m²] error of the state that both slow errors share, and its variance; 0 if they may be the sensors' own."""
    var = baro_var * gnss_var / (baro_var + gnss_var)
    shared = var * (baro / baro_var + gnss / gnss_var)
    least = _LEAST_FRACTION * wp.abs(shared)
    if shared * shared < _SIGMA * _SIGMA * var or baro * wp.sign(shared) < least or gnss * wp.sign(shared) < least:
        shared = 0.0
    return shared, var


@wp.func
def move_height(cov: wp.array2d(dtype=vec24), i: int, nominal: Nominal, shared: float, var: float) -> Nominal:
    """Height and ground moved by what the slow errors lose; their sums, which the sensors see, stay as well known."""
    nominal.pos_ned[2] = nominal.pos_ned[2] + shared
    nominal.pos_jump_ned[2] = nominal.pos_jump_ned[2] + shared
    nominal.terrain_d = nominal.terrain_d + shared
    nominal.slow[_SLOW_GNSS] = nominal.slow[_SLOW_GNSS] - shared
    nominal.slow[SLOW_BARO] = nominal.slow[SLOW_BARO] - shared
    nominal.reset_count += 1
    both = vec24()
    both[POS + 2] = var
    both[TERRAIN] = var
    cov[i, POS + 2] = cov[i, POS + 2] + both
    cov[i, TERRAIN] = cov[i, TERRAIN] + both
    cov[i, SLOW + _SLOW_GNSS] = cov[i, SLOW + _SLOW_GNSS] - both
    cov[i, SLOW + SLOW_BARO] = cov[i, SLOW + SLOW_BARO] - both
    slow_row = cov[i, SLOW_COV]
    for j in range(_SLOW_GNSS, SLOW_COUNT):
        for k in range(_SLOW_GNSS, SLOW_COUNT):
            slow_row[SLOW_COUNT * j + k] = slow_row[SLOW_COUNT * j + k] + var
    cov[i, SLOW_COV] = slow_row
    return nominal


@wp.func
def compare_heights(ekf: Ekf, i: int, params: EstimatorParams) -> None:
    """Moves the height if both sensors agree that it is wrong, and nobody outside knows better."""
    if not (is_healthy(ekf.rows[i].baro) and is_healthy(ekf.rows[i].gnss_height)):
        return
    if ekf.rows[i].external_height.is_active == 1:
        return
    nominal = ekf.rows[i].nominal
    fix = ekf.gnss_ring[i, (ekf.rows[i].gnss_inbox.tail + GNSS_RING - 1) % GNSS_RING]
    baro_var = ekf.rows[i].baro_drift_var + params.baro_noise * params.baro_noise
    gnss_var = gnss_wander_var(params, fix, _SLOW_GNSS)
    shared, var = common_error(nominal.slow[SLOW_BARO], baro_var, nominal.slow[_SLOW_GNSS], gnss_var)
    if shared != 0.0:
        ekf.rows[i].nominal = move_height(ekf.covariance, i, nominal, shared, var)
        ekf.rows[i].drag_sum.ground_d += shared
