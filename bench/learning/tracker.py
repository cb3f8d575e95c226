"""How far off is the track of an owner: with camera and phone, and after 3 s without one or both?

People walk and run among trees, their phones report as phones do, and a camera about 2 m behind sees them ten times a
second with the errors that the tracker expects. The vehicle's own position drifts by 0.6 m.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bench.row import Row, require
from common.attitude import product, quat_of
from policies.tracker import OwnerTrack, OwnerTracker, PhoneReport, Sighting, TrackerSettings
from sim.walking_owner import Owner
from sim.world.people import CHEST_M, RUN_SPEED_M_S, WALK_SPEED_M_S, person_model
from sim.world.world import WorldConfig, build_world

COMMAND = "python -m bench tracker"
DECISION_US = 100_000
_OWNERS, _SECONDS = 20, 30.0
_FIRST = 10  # decisions until the track stands
_GAP_END = slice(99, None, 100)  # last decisions of the gaps below
_OWN_STD_M, _OWN_TIME_S = 0.6, 60.0  # of the vehicle's own position
_Q_FRD_FROM_RDF = (0.5, 0.5, 0.5, 0.5)
_S = TrackerSettings()
_When = Callable[[int], bool]


def measure() -> list[Row]:
    """Root mean square errors of the position in three dimensions, and how they compare with the covariance."""
    rows: list[Row] = []
    for word, speed in (("walking", WALK_SPEED_M_S), ("running", RUN_SPEED_M_S)):
        walks = Walks(speed, _OWNERS)
        for what, is_seen, is_heard, when in (
            ("with camera and phone", always, always, slice(_FIRST, None)),
            ("after 3 s without camera", not_the_last_3_s_of_10, always, _GAP_END),
            ("after 3 s without either", not_the_last_3_s_of_10, not_the_last_3_s_of_10, _GAP_END),
        ):
            off, nees = _errors(walks, is_seen, is_heard, when)
            require(np.isfinite(off), "the track is not a number")
            name = f"track of an owner {word}, {what}"
            rows.append(Row(name, off, "m", "lower", None, COMMAND))
            rows.append(Row(f"{name}: normalised squared error (3: as told)", nees, "", "lower", None, COMMAND))
    return rows


class Walks:
    """Owners that walk, what a camera that follows them sees, and what their phones say."""

    def __init__(self, speed_max_m_s: float, owners: int, seed: int = 11) -> None:
        world = build_world(
            WorldConfig(seed=3, size_m=256.0, hill_height_m=8.0, hill_wavelength_m=120.0, trees_per_ha=100.0)
        )
        owner = Owner(world, np.zeros((owners, 3)), seed, model=person_model(speed_max_m_s))
        self.owners = owners
        self.steps = int(_SECONDS * 1e6 / DECISION_US)
        shape = (self.steps, owners, 3)
        self.pos_ned, self.vel_ned = np.empty(shape), np.empty(shape)
        self.reports: list[list[PhoneReport | None]] = [[None] * owners for _ in range(self.steps)]
        self.rng = rng = np.random.default_rng(seed)
        own = _OWN_STD_M * rng.standard_normal((owners, 3))
        own_rate = np.zeros((owners, 3))
        for k in range(self.steps):
            for part in range(5):
                owner.step_to(25 * k + 5 * part)
                for i, fix in enumerate(owner.phones.numpy()["fix"]):
                    if fix["is_new"]:
                        self.reports[k][i] = PhoneReport(
                            int(fix["time_us"]), fix["pos_ned"].copy(), fix["vel_ned"].copy()
                        )
            # the vehicle's own error drifts smoothly: its filter has no jumps
            own_rate += -0.1 * own_rate + 0.01 * np.sqrt(0.2) * rng.standard_normal((owners, 3))
            own = own * np.exp(-0.1 / _OWN_TIME_S) + 0.1 * own_rate
            rows = owner.people.numpy()
            self.pos_ned[k] = rows["pos_ned"] - [0.0, 0.0, float(CHEST_M)] + own  # the chest in the vehicle's frame
            self.vel_ned[k] = rows["vel_ned"] + own_rate
        yaw = rng.uniform(-np.pi, np.pi, owners)
        self.offset_ned = np.stack([-2.0 * np.cos(yaw), -2.0 * np.sin(yaw), np.full(owners, -0.7)], axis=-1)
        self.yaw_rad = yaw

    def camera(self, k: int, i: int) -> NDArray[np.float64]:
        """Where the camera is: about 2 m behind the owner."""
        return self.pos_ned[k, i] + self.offset_ned[i] + 0.3 * np.sin(0.1 * k + np.arange(3))

    def sighting(self, k: int, i: int, *, has_range: bool = True) -> Sighting:
        """The owner as the camera of vehicle i sees them at decision k, with noise."""
        camera = self.camera(k, i)
        way = self.pos_ned[k, i] - camera
        distance = float(np.linalg.norm(way))
        cos, sin = np.cos(self.yaw_rad[i]), np.sin(self.yaw_rad[i])
        forward, right, down = cos * way[0] + sin * way[1], cos * way[1] - sin * way[0], way[2]
        noise = self.rng.standard_normal(3)
        return Sighting(
            float(np.arctan2(right, forward)) + _S.direction_std_rad * noise[0],
            float(np.arctan2(-down, np.hypot(forward, right))) + _S.direction_std_rad * noise[1],
            distance + (_S.range_std_m + _S.range_std_fraction * distance) * noise[2] if has_range else None,
            camera,
            product(quat_of(self.yaw_rad[i], 0.0), _Q_FRD_FROM_RDF),
        )


def track(walks: Walks, i: int, is_seen: _When, is_heard: _When) -> list[OwnerTrack]:
    """Tracks at all decisions of one owner; `is_seen(k)` and `is_heard(k)` say what there is."""
    tracker = OwnerTracker()
    tracks = []
    for k in range(walks.steps):
        time_us = k * DECISION_US
        report = walks.reports[k][i]
        if report is not None and is_heard(k):
            tracker.hear(time_us, report)
        if is_seen(k):
            tracker.see(time_us, walks.sighting(k, i))
        tracks.append(tracker.at(time_us))
    return tracks


def errors(walks: Walks, i: int, tracks: list[OwnerTrack]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of place and velocity, shape (decisions, 3) each."""
    pos, vel = np.array([t.pos_ned for t in tracks]), np.array([t.vel_ned for t in tracks])
    return pos - walks.pos_ned[:, i], vel - walks.vel_ned[:, i]


def normalised(error: NDArray[np.float64], cov: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared errors in units of their covariance, shape (decisions,)."""
    return np.einsum("ki,ki->k", error, np.linalg.solve(cov, error[..., None])[..., 0])


def always(_k: int) -> bool:
    """At every decision."""
    return True


def not_the_last_3_s_of_10(k: int) -> bool:
    """Gaps of 3 s."""
    return k % 100 < 70


def _errors(walks: Walks, is_seen: _When, is_heard: _When, when: slice) -> tuple[float, float]:
    """Root mean square error of the position, and the mean normalised squared one, at some decisions of all owners."""
    squares, nees = [], []
    for i in range(walks.owners):
        tracks = track(walks, i, is_seen, is_heard)
        pos = errors(walks, i, tracks)[0]
        squares.append(np.square(pos).sum(axis=1)[when])
        nees.append(normalised(pos, np.array([t.pos_cov for t in tracks]))[when])
    return float(np.sqrt(np.mean(squares))), float(np.mean(nees))
