"""The plot of how smoothly the policy that ships follows somebody who walks.

`python -m docs.generate.smoothness_plot`. Writes docs/results/images/smoothness.png.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np

from mission.flight import FlightConfig
from mission.flight_config import OwnerConfig
from mission.follow.follow_scoring import FollowWatch
from mission.follow.lockstep import flight_with_companion, follow_for
from policies.companion.guard.settings import GuardSettings
from policies.companion.names import FOLLOWER
from policies.companion.skills.load_skill import load_follower
from policies.tasks.follow_me.world import FOLLOW_WORLD

PLOT = Path(__file__).parents[1] / "results" / "images" / "smoothness.png"
SEED, SECONDS, WIND_M_S = 3200101, 60.0, 4.0


def main() -> None:
    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415  after the choice of the backend

    config = FlightConfig(world=FOLLOW_WORLD, owner=OwnerConfig(pace="walk"), seed=SEED, wind_m_s=WIND_M_S)
    flight, companion = flight_with_companion(config, load_follower(FOLLOWER), guard=GuardSettings())
    owner: list[float] = []

    def look(watch: FollowWatch) -> None:
        if watch.sample_count > len(owner):
            owner.append(float(np.hypot(*flight.owner.cast.rows.people.numpy()[0]["vel_ned"][:2])))

    watch = follow_for(flight, companion, SECONDS, look)
    track, smoothness = watch.track(), watch.smoothness()
    figure, (speeds, distances, accels) = plt.subplots(3, 1, figsize=(8, 6), sharex=True, layout="constrained")
    speeds.plot(track.time_s, owner, label="owner", color="tab:orange")
    speeds.plot(track.time_s, np.hypot(*watch.motion[:, :2].T), label="vehicle", color="tab:blue", linewidth=1.0)
    speeds.set_ylabel("level speed [m/s]")
    speeds.legend(loc="upper right", ncols=2)
    distances.axhspan(1.0, 3.0, color="tab:green", alpha=0.15, linewidth=0.0)
    distances.plot(track.time_s, track.distance_m, color="tab:blue")
    distances.set_ylabel("to the chest [m]")
    distances.set_ylim(0.0, 4.0)
    accels.plot(track.time_s[1:], watch.accel, color="tab:blue", linewidth=1.0)
    accels.axhline(smoothness.accel_rms, color="black", linestyle="--", linewidth=1.0)
    accels.set_ylabel("own level\nacceleration [m/s²]")
    accels.set_xlabel("time [s]")
    accels.set_title(
        f"RMS {smoothness.accel_rms:.2f} m/s², yaw rate {smoothness.yaw_rate_rms:.0f} deg/s", fontsize="medium"
    )
    figure.savefig(PLOT, dpi=100)
    print(f"{PLOT.name}: {smoothness}, {PLOT.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
