"""FollowMe: a drone keeps 1 to 3 m from its owner's chest, who walks and runs through hills and trees.

In: an action, 10 Hz: velocity and yaw rate for the flight controller, or the document's three choices. Out: what the
vehicle knows of itself and of the owner, and its camera's image; of teachers, the truth. The simulator and the flight
controller are those of every flight.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import warp as wp
from numpy.typing import NDArray

from policies.tasks.flight.flight_params import FLIGHT_PARAMS, FlightParams
from policies.tasks.flight.hover_bank import LOW_M
from policies.tasks.flight.own_state import ACTIONS, Command
from policies.tasks.flight.ranges import RANGES, measure_ranges
from policies.tasks.flight.task import DECISION_TICKS, FlightTask
from policies.tasks.follow_me.cast import PEOPLE_MAX
from policies.tasks.follow_me.follow_me_kernels import (
    ACT_TICKS,
    MEASURES,
    FollowState,
    Rules,
    act,
    decide,
    judge,
    look,
    place,
    prepare,
    show,
    walk,
)
from policies.tasks.follow_me.follow_me_params import (
    DOCUMENTED,
    IMPROVED,
    PARAMS,
    SEEN_BY_TRACKER,
    TREES_PER_HA_MAX,
    FollowParams,
)
from policies.tasks.follow_me.follow_me_top_view import draw
from policies.tasks.follow_me.image_way import make_way, note
from policies.tasks.follow_me.observe import (
    BRANCHES,
    DOCUMENT,
    EGO,
    EGO_BLIND,
    IMAGE_CHANNELS,
    LAYOUT_VERSION,
    TRACKED,
    vector_elements,
)
from policies.tasks.follow_me.others import mark_others, see_others
from policies.tasks.follow_me.owner_visibility import Sight
from policies.tasks.follow_me.privileged import PRIVILEGED_ELEMENTS
from policies.tasks.follow_me.settings import FollowSettings
from policies.tasks.follow_me.task_cameras import Eyes
from policies.tasks.follow_me.tracked.keep_off import keep_off
from policies.tasks.follow_me.tracked.quick_vehicle import QUICK, trained_brake_m_s2
from policies.tasks.follow_me.tracked.sight_model import make_tracked, sense
from policies.tasks.follow_me.tracked.vector import TRACKED_ELEMENTS
from policies.tasks.follow_me.world import FOLLOW_WORLD
from policies.tasks.layout import ImageElement, Layout
from policies.tasks.task_params import Sampler, typed_rows
from sim.sensors.camera import Lens
from sim.sensors.phone import PhoneModel, PhoneState, phone_model
from sim.world.clothes import Clothes, usual_clothes
from sim.world.people import RUN_SPEED_M_S, WALK_SPEED_M_S, Person, PersonModel, person_model

_OWNERS: dict[str, float | Sampler] = {
    "walks": WALK_SPEED_M_S,
    "runs": RUN_SPEED_M_S,
    "any": Sampler(intervals=((1.0, RUN_SPEED_M_S), (4.0, 6.0), (4.0, 6.0))),  # the fastest are the hardest to follow
}
_TAKEOVER_M = (1.5, 3.5)  # heights at which a companion may take over
_VECTORS = {"as-documented": int(DOCUMENT), "improved": int(EGO), "vision-only": int(EGO_BLIND)}


class FollowMe(FlightTask):
    """The task. See `LAYOUT_VERSION`."""

    params: ClassVar = PARAMS
    settings_class: ClassVar = FollowSettings

    def __init__(self, settings: FollowSettings, env_count: int, device: str = "cpu") -> None:
        is_documented = settings.preset == "as-documented"
        super().__init__(
            _layout(settings),
            env_count,
            FOLLOW_WORLD,
            trees_per_ha_max=TREES_PER_HA_MAX,
            has_estimator=settings.has_estimator,
            number_defaults=_numbers(settings) | {"owner_speed_max": _OWNERS[settings.owner]},
            device=device,
            split=settings.split,
            airframes=settings.airframes,
            hover_heights_m=LOW_M if is_documented else _TAKEOVER_M,
            parameters=tuple(QUICK.items()) if settings.observation == "tracked" else (),
        )
        self.settings = settings
        self.follow = self._state()
        self.measures = self.follow.measures
        self._eyes: Eyes | None = None
        if self.layout.image is not None:
            state, way = self.follow, make_way(self._zeros, self.layout.image_shape, env_count)
            seen = [state.drawn, state.clothes, way, state.path_seeds]
            self._eyes = Eyes(self.buffers, self.rig.arrays, state.params, self.worlds, *seen)
            state.lenses, state.image_ages_s = self._eyes.lenses, way.age_s
        state = self.follow
        state.tracked = make_tracked(self._zeros, env_count if self._is_tracked else 1)
        if self._is_tracked:
            self._sight_way = make_way(self._zeros, (1, 1, 1), env_count)  # of images that nobody takes
            state.image_ages_s = self._sight_way.age_s
        self._record_all(_rules(settings, self.layout), self.start())

    def _launch_step(self) -> None:
        """What `step` does of the task's own."""
        self._decide.launch()
        for act_part in self._acts:
            act_part.launch()
            self.rig.advance(ACT_TICKS)
        self._walk.launch()
        self._look_all.launch()
        if self._sees_truth:
            self._measure_all.launch()
        if self._eyes is not None:
            self._eyes.take()
        if self._is_tracked:
            self._sense(self.follow.is_all)
        if self._sees_truth:
            self._mark_all.launch()
        self._judge.launch()
        self.keep_last_images()
        self._begin_rows()

    def _begin_rows(self) -> None:
        """Starts the episodes of the rows that are starting."""
        self._prepare.launch()
        self.take_off()
        self._place.launch()
        self._look_starting.launch()
        if self._sees_truth:
            self._measure_starting.launch()
        if self._eyes is not None:
            self._eyes.refresh(self.is_growing)
            self._eyes.take(self.is_starting)
        if self._is_tracked:
            self._sense(self.is_starting, is_first=True)
        if self._sees_truth:
            self._mark_starting.launch()
        self._show.launch()

    def load_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Restores what `state` returned."""
        super().load_state(state)
        if self._eyes is not None:
            self._eyes.refresh()

    def _sense(self, rows: Any, *, is_first: bool = False) -> None:
        """Draws the sights of new pictures, of the chosen rows, and takes in those that have come."""
        for launch, first, chosen in ((self._note, 2, 3), (self._sense_rows, 9, 10), (self._see_others, 4, 5)):
            launch.set_param_at_index(first, int(is_first))
            launch.set_param_at_index(chosen, rows)
            launch.launch()

    @property
    def _is_tracked(self) -> bool:
        return self.settings.observation == "tracked"

    @property
    def _sees_truth(self) -> bool:
        return self.settings.observation == "state" or bool(self.layout.privileged)

    def top_view(self, i_env: int, height_px: int = 480) -> NDArray[np.uint8]:
        """Drone and owner from above, and what the camera sees."""
        truth = self.rig.truth_row(i_env)
        owner = self.follow.people.numpy()[i_env]
        x, y, z, w = (float(value) for value in truth["q_ned_from_frd"])
        yaw = float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
        distance, seen = self.measures.numpy()[i_env, [0, 2]]
        words = f"{float(self.buffers.steps.numpy()[i_env]) * self.decision_s:4.1f} s  {distance:4.1f} m"
        return draw(
            self.worlds.map(i_env),
            truth["pos_ned"].astype(np.float64),
            yaw,
            owner["pos_ned"].astype(np.float64),
            float(owner["heading_rad"]),
            self.buffers.images.numpy()[i_env] if self._eyes is not None else None,
            words + ("" if seen else "  not in view"),
            height_px,
        )

    def _state(self) -> Any:
        n = self.env_count
        state = FollowState()
        state.flight = typed_rows(self.buffers.params, FlightParams)
        state.params = typed_rows(self.buffers.params, FollowParams, first=len(FLIGHT_PARAMS))
        state.actions = self._zeros("last_actions", n, wp.vec4)
        state.asked = wp.zeros(n, dtype=Command, device=self.device)  # of one step only
        state.people = self._zeros("people", n, Person)
        others = PEOPLE_MAX - 1
        state.bystanders = self._zeros("bystanders", (n, others), Person)
        state.drawn = self._zeros("drawn", (n, PEOPLE_MAX), Person)
        state.clothes = self._zeros("clothes", (n, PEOPLE_MAX), Clothes)
        state.usual_clothes = wp.array([usual_clothes()], dtype=Clothes, device=self.device)
        state.image_ages_s = wp.zeros(n, dtype=float, device=self.device)
        state.person_models = self._zeros("person_models", n, PersonModel)
        state.phones = self._zeros("phones", n, PhoneState)
        state.phone_models = self._zeros("phone_models", n, PhoneModel)
        state.path_seeds = self._zeros("path_seeds", n, int)
        state.sights = self._zeros("sights", n, Sight)
        state.reaches_m = wp.zeros(n, dtype=float, device=self.device)  # of one step only
        state.unseen_s = self._zeros("unseen_s", n, float)
        state.nearness = self._zeros("nearness", (n, RANGES), float)
        state.lenses = self._zeros("lenses", n, Lens)
        state.measures = self._zeros("measures", (n, len(MEASURES)), float)
        state.is_all = wp.full(n, value=True, dtype=wp.bool, device=self.device)
        state.usual_person = wp.array([person_model()], dtype=PersonModel, device=self.device)
        state.usual_phone = wp.array([phone_model()], dtype=PhoneModel, device=self.device)
        return state

    def _record_all(self, rules: Any, start: Any) -> None:
        buffers, rig, state = self.buffers, self.rig.arrays, self.follow

        record = self.record
        parts = range(DECISION_TICKS // ACT_TICKS)
        self._decide = record(decide, buffers, rules, rig, state)
        self._acts = [record(act, rig, state, part) for part in parts]
        self._walk = record(walk, buffers, rules, rig, state)
        self._look_all = record(look, rig, state, state.is_all)
        self._measure_all = record(measure_ranges, rig, state.is_all, state.nearness)
        self._mark_all = record(mark_others, rig, state.drawn, state.is_all, state.nearness)
        if self._is_tracked:
            seen = [state.params, state.sights, state.drawn, state.nearness, state.path_seeds]
            way, everyone = self._sight_way, state.is_all
            self._note = record(note, state.params, state.path_seeds, 0, everyone, way)
            self._sense_rows = record(sense, rig, rules.has_estimator, *seen, way, state.tracked, 0, everyone)
            self._see_others = record(see_others, rig, state.params, state.drawn, state.tracked, 0, everyone)
        self._judge = record(judge, buffers, rules, rig, state, start)
        self._prepare = record(prepare, buffers, rules, state, start)
        self._place = record(place, buffers, rig, state, start)
        self._look_starting = record(look, rig, state, self.is_starting)
        self._measure_starting = record(measure_ranges, rig, self.is_starting, state.nearness)
        self._mark_starting = record(mark_others, rig, state.drawn, self.is_starting, state.nearness)
        self._show = record(show, buffers, rules, rig, state, start)


def _numbers(settings: FollowSettings) -> dict[str, float | Sampler]:
    """What the numbers of an episode are drawn from, but for the owner's speed."""
    if settings.observation == "tracked":
        return IMPROVED | SEEN_BY_TRACKER
    return DOCUMENTED if settings.preset == "as-documented" else IMPROVED


def _layout(settings: FollowSettings) -> Layout:
    if settings.observation == "tracked":
        stack = settings.stack or 1
        return Layout(
            "FollowMe",
            LAYOUT_VERSION,
            TRACKED_ELEMENTS,
            continuous=ACTIONS,
            stack=stack,
            privileged=PRIVILEGED_ELEMENTS,
        )
    is_camera = settings.observation == "camera"
    is_documented = settings.preset == "as-documented"
    channels = IMAGE_CHANNELS[:3] if is_documented else IMAGE_CHANNELS
    return Layout(
        "FollowMe",
        LAYOUT_VERSION,
        vector_elements(_VECTORS[settings.preset]) if is_camera else PRIVILEGED_ELEMENTS,
        continuous=() if is_documented else ACTIONS,
        branches=BRANCHES if is_documented else (),
        stack=settings.stack or 1,
        image=ImageElement(settings.image_size, settings.image_size, channels) if is_camera else None,
        privileged=PRIVILEGED_ELEMENTS if is_camera and not is_documented else (),
    )


def _rules(settings: FollowSettings, layout: Layout) -> Any:
    rules = Rules()
    vectors = {"camera": _VECTORS[settings.preset], "tracked": int(TRACKED), "state": -1}
    rules.vector = vectors[settings.observation]
    rules.is_documented = int(settings.preset == "as-documented")
    rules.has_estimator = int(settings.has_estimator)
    rules.has_privileged = int(bool(layout.privileged))
    rules.is_kept = int(settings.terrain == "kept")
    rules.decision_ticks = DECISION_TICKS
    rules.keep_off = keep_off(brake=trained_brake_m_s2(settings.airframes))  # of who goes by the senses
    return rules
