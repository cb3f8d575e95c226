"""Where JSBSim's bodies are: a planet so large that it is flat, the way to put a body there, and to ask where it is."""

from typing import Any

from common.attitude import roll_pitch_yaw_of
from common.geodesy import GRAVITY_M_S2

FT_M, LBF_N = 0.3048, 4.4482216152605  # exact, NIST SP 811; JSBSim speaks of feet and pounds
_RADIUS_M = 1.0e9  # a kilometre from home, down is a microradian aslant, and a double still tells 0.1 um
PLANET = f"""<planet name="flat">
    <semimajor_axis unit="M">{_RADIUS_M}</semimajor_axis>
    <semiminor_axis unit="M">{_RADIUS_M}</semiminor_axis>
    <rotation_rate unit="RAD/SEC">0</rotation_rate>
    <GM unit="M3/SEC2">{GRAVITY_M_S2 * _RADIUS_M**2}</GM>
    <J2>0</J2>
  </planet>"""
MOTION = [f"position/from-start-neu-{axis}-ft" for axis in "neu"]  # from where it was put; up from sea level
MOTION += [f"velocities/v-{axis}-fps" for axis in ("north", "east", "down")]
MOTION += [f"attitude/{angle}-rad" for angle in ("phi", "theta", "psi")]
MOTION += [f"velocities/{axis}-rad_sec" for axis in "pqr"]


def put_at(sim: Any, row: Any, home_alt_m: float) -> tuple[float, float, float]:
    """Makes a row of a body's `State` the initial condition, for `run_ic`.

    Args:
        sim: `FGFDMExec`.
        row: with pos_ned, vel_ned, q_ned_from_frd, omega_frd.
        home_alt_m: of home over JSBSim's sea level.

    Returns:
        Where its north, east and up then count from, ned [m].
    """
    north_m, east_m, down_m = row["pos_ned"].tolist()
    north_fps, east_fps, down_fps = (row["vel_ned"] / FT_M).tolist()
    roll, pitch, yaw = roll_pitch_yaw_of(row["q_ned_from_frd"].tolist())
    p, q, r = row["omega_frd"].tolist()
    for name, value in {
        "lat-gc-rad": 0.0, "long-gc-rad": 0.0, "h-sl-ft": (home_alt_m - down_m) / FT_M,
        "vn-fps": north_fps, "ve-fps": east_fps, "vd-fps": down_fps,
        "phi-rad": roll, "theta-rad": pitch, "psi-rad": yaw,
        "p-rad_sec": p, "q-rad_sec": q, "r-rad_sec": r,
    }.items():  # fmt: skip
        sim[f"ic/{name}"] = value
    return north_m, east_m, home_alt_m
