"""The owner of a flight: a person in the world with a phone, a batch of them for tests and images.

In: the tick. Out: `people`, which cameras draw, and the phone's newest report. Flights hold one owner; training steps
`person_step` and `phone_step` in its own kernels, so that both get the same walk from the same seed and row.
"""

from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from common.kernels import TICK_US
from sim.sensors.phone import PhoneModel, PhoneState, phone_model, phone_start, phone_step
from sim.world.people import PERSON_DT_S, PERSON_TICKS, Person, PersonModel, person_model, person_start, person_step
from sim.world.world import World, WorldMap

wp.set_module_options({"enable_backward": False})

_STEP_S = wp.constant(PERSON_DT_S)


@wp.kernel
def _start(
    world: World,
    model: PersonModel,
    phone: PhoneModel,
    positions: wp.array[wp.vec3],  # north [m], east [m], heading [rad]
    seed: int,
    people: wp.array[Person],
    phones: wp.array[PhoneState],
) -> None:
    i = wp.tid()
    position = positions[i]
    people[i] = person_start(world, model, position[0], position[1], position[2], seed, i, 0)
    phones[i] = phone_step(phone, phone_start(phone, seed, i, 0), people[i], seed, i, 0)


@wp.kernel
def _step(
    world: World,
    model: PersonModel,
    phone: PhoneModel,
    seed: int,
    tick: int,
    people: wp.array[Person],
    phones: wp.array[PhoneState],
) -> None:
    i = wp.tid()
    people[i] = person_step(world, model, people[i], seed, i, tick - PERSON_TICKS, _STEP_S)
    phones[i] = phone_step(phone, phones[i], people[i], seed, i, tick)


class Owner:
    """One owner of a flight, or several that do not see each other.

    Args:
        world: where they walk.
        places: where each starts: north [m], east [m], heading [rad], shape (owners, 3).
        seed: of the walks and of the phones.
        model: how they move.
        phone: how good their phones are.
    """

    def __init__(
        self,
        world: WorldMap,
        positions: Any,
        seed: int,
        *,
        model: Any = None,
        phone: Any = None,
    ) -> None:
        start = np.asarray(positions, np.float32).reshape(-1, 3)
        self.people = wp.zeros(len(start), dtype=Person)
        self.phones = wp.zeros(len(start), dtype=PhoneState)
        self._tick = 0
        given = [world.kernel, model or person_model(), phone or phone_model()]
        wp.launch(_start, len(start), [*given, wp.array(start, dtype=wp.vec3), seed, self.people, self.phones])
        inputs = [*given, seed, self._tick, self.people, self.phones]
        self._step = wp.launch(_step, len(start), inputs, record_cmd=True)
        self._world = world  # recorded launches do not keep it
        self._has_report: NDArray[np.int32] = self.phones.numpy()["fix"]["is_new"]  # live

    @property
    def time_us(self) -> int:
        """The time of `people`, since the start."""
        return self._tick * TICK_US

    def change_model(self, model: Any) -> None:
        """They move by another model from the next plan on: a person who waited sets off."""
        self._step.set_param_at_index(1, model)

    def step_to(self, tick: int) -> bool:
        """Moves on to the last multiple of PERSON_TICKS at or before a tick; true if a phone reported on the way."""
        has_report = False
        while self._tick + PERSON_TICKS <= tick:
            self._tick += PERSON_TICKS
            self._step.set_param_at_index_from_ctype(4, self._tick)
            self._step.launch()
            has_report = has_report or any(self._has_report.tolist())
        return has_report
