"""The people of one flight beside its owner, and how cameras see them all; by the functions of training.

In: the owner, step by step, and the numbers of the following. Out: arrays of one row, which cameras draw and a
scorecard measures.
"""

from collections.abc import Mapping
from typing import Any

import warp as wp

from policies.tasks.follow_me.cast import (
    BYSTANDERS_MAX,
    PEOPLE_MAX,
    bystander_start,
    bystander_step,
    clothes_of,
    drawn_owner,
    owner_of,
    phone_of,
)
from policies.tasks.follow_me.follow_me_params import FOLLOW_PARAMS, FollowParams
from sim.sensors.phone import PhoneModel, phone_model
from sim.truth import Truth
from sim.world.clothes import Clothes, usual_clothes
from sim.world.people import PERSON_TICKS, Person, PersonModel, person_model
from sim.world.world import World, WorldMap

wp.set_module_options({"enable_backward": False})


@wp.struct
class CastRows:
    """One flight's."""

    params: wp.array(dtype=FollowParams)
    people: wp.array(dtype=Person)
    bystanders: wp.array2d(dtype=Person)
    drawn: wp.array2d(dtype=Person)
    clothes: wp.array2d(dtype=Clothes)


@wp.kernel(enable_backward=False)
def _begin(world: World, model: PersonModel, usual: Clothes, seed: int, rows: CastRows) -> None:
    n = rows.params[0]
    owner = rows.people[0]
    for k in range(BYSTANDERS_MAX):
        rows.bystanders[0, k] = bystander_start(world, model, n, owner, seed, 0, k + 1, 0)
        rows.drawn[0, k + 1] = rows.bystanders[0, k]
        rows.clothes[0, k + 1] = clothes_of(n, usual, seed, 0, k + 1)
    rows.drawn[0, 0] = owner
    rows.clothes[0, 0] = clothes_of(n, usual, seed, 0, 0)


@wp.kernel(enable_backward=False)
def _step(
    world: World,
    model: PersonModel,
    truths: wp.array(dtype=Truth),
    seed: int,
    tick: int,
    since_s: float,
    rows: CastRows,
) -> None:
    owner = rows.people[0]
    vehicle_ned = truths[0].pos_ned
    then = tick - PERSON_TICKS
    for k in range(BYSTANDERS_MAX):
        if since_s >= 0.0:
            person = rows.bystanders[0, k]
            rows.bystanders[0, k] = bystander_step(world, model, person, owner, vehicle_ned, seed, 0, k + 1, then)
        rows.drawn[0, k + 1] = rows.bystanders[0, k]
    rows.drawn[0, 0] = drawn_owner(owner, rows.params[0], seed, 0, wp.max(since_s, 0.0))


@wp.kernel(enable_backward=False)
def _models(
    params: wp.array(dtype=FollowParams), people: wp.array(dtype=PersonModel), phones: wp.array(dtype=PhoneModel)
) -> None:
    people[0] = owner_of(people[0], params[0])
    phones[0] = phone_of(phones[0], params[0])


def walk_and_phone(numbers: Mapping[str, float]) -> tuple[Any, Any]:
    """How the owner of a flight walks, and their phone: a `PersonModel` and a `PhoneModel`."""
    people: Any = wp.array([person_model()], dtype=PersonModel)
    phones: Any = wp.array([phone_model()], dtype=PhoneModel)
    wp.launch(_models, 1, [params_row(numbers), people, phones])
    return _struct(PersonModel, people), _struct(PhoneModel, phones)


def _struct(kind: Any, rows: Any) -> Any:
    """The first of an array of structs, as a value."""
    row, value = rows.numpy()[0], kind()
    for name in kind.vars:
        field = row[name]
        setattr(value, name, field.item() if field.ndim == 0 else wp.vec3(*field.tolist()))
    return value


class FlownCast:
    """The people of one flight.

    Args:
        world: where they walk.
        truths: the vehicles: array of `Truth`; people give way to the first.
        people: the owner: array of one `Person`, which somebody else steps.
        model: how all of them walk.
        numbers: of FollowMe, by name; the others are at their defaults.
        seed: of the walks and clothes.
    """

    def __init__(
        self, world: WorldMap, truths: Any, people: Any, model: Any, numbers: Mapping[str, float], seed: int
    ) -> None:
        self.rows: Any = CastRows()
        self.rows.params = params_row(numbers)
        self.rows.people = people
        self.rows.bystanders = wp.zeros((1, PEOPLE_MAX - 1), dtype=Person)
        self.rows.drawn = wp.zeros((1, PEOPLE_MAX), dtype=Person)
        self.rows.clothes = wp.zeros((1, PEOPLE_MAX), dtype=Clothes)
        wp.launch(_begin, 1, [world.kernel, model, usual_clothes(), seed, self.rows])
        inputs = [world.kernel, model, truths, seed, 0, -1.0, self.rows]
        self._step = wp.launch(_step, 1, inputs, record_cmd=True)
        self._kept = (world, truths)  # recorded launches do not

    def step(self, tick: int, since_s: float) -> None:
        """Moves on to a tick, PERSON_TICKS after the last; `since_s` after the owner has set off, below 0: not yet."""
        self._step.set_param_at_index_from_ctype(4, tick)
        self._step.set_param_at_index_from_ctype(5, since_s)
        self._step.launch()


def params_row(numbers: Mapping[str, float]) -> Any:
    """An array of one `FollowParams`: the defaults, and what is given.

    Raises:
        KeyError: there is no such number.
    """
    row: Any = wp.zeros(1, dtype=FollowParams)
    values = {number.name: number.default for number in FOLLOW_PARAMS}
    for name, value in {**values, **numbers}.items():
        if name not in values:
            raise KeyError(name)
        row.numpy()[name] = value
    return row
