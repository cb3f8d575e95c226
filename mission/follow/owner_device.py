"""The owner of a flight: a person who walks through its world, and their phone, a MAVLink client of its own.

In: the time, and whether the vehicle follows yet. Out: `cast`, which cameras draw, and FOLLOW_TARGET twice a second
with a phone's lag and error. Nobody walks off before the drone is there: until it follows, the owner stands.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot.mavlink.client_end import GROUND_STATION, ClientEnd
from autopilot.mavlink.transport.links import LinkRole, memory_pair
from autopilot.mavlink.wire.convert import degrees_e7
from common.attitude import Vector
from common.geodesy import GeoPoint, geodetic_from_ned
from common.kernels import TICK_US
from mission.flight_config import OwnerConfig
from mission.flight_settings import Pace
from policies.tasks.follow_me.flown_cast import FlownCast, walk_and_phone
from sim.sensors.phone import CORRELATED_STD_M, POSITION_STD_M, VERTICAL_FACTOR
from sim.walking_owner import Owner
from sim.world.people import CHEST_M, RUN_SPEED_M_S, WALK_SPEED_M_S, person_model
from sim.world.world import WorldMap

SPEEDS_M_S: dict[Pace, float] = {"walk": WALK_SPEED_M_S, "run": RUN_SPEED_M_S}
PHONE_SYSTEM, PHONE_COMPONENT = 254, 190  # guess: a station's numbers, not those of other clients
_SETS_OFF_S = (0.5, 2.0)  # that late at most, as at the start of an episode of training
_HAS_POSITION_AND_VELOCITY = 3  # FOLLOW_TARGET.est_capabilities
_NOT_GIVEN = (0.0, 0.0, 0.0)


class FollowedOwner:
    """The owner of one flight.

    Args:
        config: who.
        world: where they walk.
        truths: the vehicles, array of `Truth`; other people give way to the first.
        seed: of their path and of the phone's errors.
        home: origin of ned.
    """

    def __init__(self, config: OwnerConfig, world: WorldMap, truths: Any, seed: int, home: GeoPoint) -> None:
        still = person_model(0.0)
        still.speed_min = 0.0
        still.plan_min_s, still.plan_max_s = _SETS_OFF_S  # who then follows need not wait for a long plan to end
        self._home = home
        numbers: dict[str, float] = {"owner_speed_max": SPEEDS_M_S[config.pace], **config.numbers}
        self._walking, phone = walk_and_phone(numbers)
        towards_home_rad = np.pi
        self._owner = Owner(
            world,
            [[config.start_m, 0.0, towards_home_rad]],
            seed,
            model=still,
            phone=phone,
        )
        self.cast = FlownCast(world, truths, self._owner.people, self._walking, numbers, seed)
        self._person: NDArray[Any] = self._owner.people.numpy()  # live, as the next
        self._phone: NDArray[Any] = self._owner.phones.numpy()
        horizontal = numbers.get("phone_error", 1.0) ** 2 * (CORRELATED_STD_M**2 + POSITION_STD_M**2)
        self._pos_var = (horizontal, horizontal, VERTICAL_FACTOR**2 * horizontal)
        self.vehicle_end, self._link = memory_pair(LinkRole.GROUND)
        self._client = ClientEnd(self._link, PHONE_SYSTEM, PHONE_COMPONENT, mav_type=GROUND_STATION)
        self.is_walking = False
        self._since_us = 0  # when they set off

    @property
    def people(self) -> Any:
        """Where they truly are: an array of one `Person`."""
        return self._owner.people

    @property
    def chest_ned(self) -> Vector:
        """[m] True place of what a follower keeps its distance to."""
        north, east, down = (float(element) for element in self._person[0]["pos_ned"])
        return (north, east, down - float(CHEST_M))

    @property
    def vel_ned(self) -> Vector:
        """[m/s] True velocity."""
        north, east, down = (float(element) for element in self._person[0]["vel_ned"])
        return (north, east, down)

    def frame(self, time_us: int, *, is_followed: bool) -> None:
        """Walks on, and sends what the phone has to say.

        Args:
            time_us: simulated time.
            is_followed: the vehicle follows: the owner sets off.
        """
        if is_followed and not self.is_walking:
            self.is_walking = True
            self._since_us = time_us
            self._owner.change_model(self._walking)
        has_report = self._owner.step_to(time_us // TICK_US)
        self.cast.step(time_us // TICK_US, (time_us - self._since_us) * 1e-6 if self.is_walking else -1.0)
        self._link.receive()  # a phone hears the vehicle's telemetry too; ours does not care
        self._client.keep_alive(time_us)
        if has_report:
            self._report()

    def _report(self) -> None:
        fix = self._phone[0]["fix"]
        north, east, down = (float(element) for element in fix["pos_ned"])
        lat_deg, lon_deg, alt_m = geodetic_from_ned(north, east, down, self._home)
        self._client.send(
            "FOLLOW_TARGET",
            timestamp=int(fix["time_us"]) // 1000,
            est_capabilities=_HAS_POSITION_AND_VELOCITY,
            lat=degrees_e7(lat_deg),
            lon=degrees_e7(lon_deg),
            alt=alt_m,
            vel=tuple(float(element) for element in fix["vel_ned"]),
            acc=_NOT_GIVEN,
            attitude_q=(1.0, *_NOT_GIVEN),
            rates=_NOT_GIVEN,
            position_cov=self._pos_var,
        )
