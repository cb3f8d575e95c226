"""What people can do on the live page: send the vehicle somewhere, change wind and pace, break a motor.

In: clicks, on viser's threads. Out: tasks for the flight's thread. Vehicle commands go through the flight's scripting
client over MAVLink, as any ground station's would; wind and motors are the simulator's own.
"""

from collections.abc import Callable, Coroutine, Sequence
from math import hypot, isnan, nan
from typing import Any

import viser

from autopilot.interface.failure_requests import Failure, Unit
from autopilot.mavlink.dialects.px4 import PX4
from mission.client import Running
from mission.flight_base import FlightBase
from mission.script import Drone, ScriptError, take_off
from mission.view.browser_inputs import within
from mission.view.pose_goals import Pose, PoseGoals
from sim.bodies.vehicles import class_of

CLIMB_M = 5.0  # above the ground, when a click finds the vehicle standing
FAR_M = 2000.0  # of a click's ray
LEAST_HEIGHT_M = 2.0
DRIVEN_WITHIN_M = 1.0  # a click's place is reached
HEIGHT_MAX_M = 60.0
WIND_MAX_M_S = 20.0
SPEEDS = {"1/4 x": 0.25, "1/2 x": 0.5, "1 x": 1.0, "2 x": 2.0, "5 x": 5.0, "max": None}
SETTLES_S = 30.0  # after power-on a vehicle that is not ready may be so without being helped
_LINES = 3  # what happened last: one thing soon follows another


class Controls:
    """Buttons and sliders of one flight, or of the one of several that is chosen.

    Args:
        flight: what they act on.
        server: of the page.
        do: hands a task to the flight's thread.
        speed: at which the flight begins.
        change_speed: sets it.
        has_plan: the vehicle has a mission, or is about to get one.
        goals: where its companion can be sent; a click on the ground is for it then.
        others: other flights in its world.

    Attributes:
        flight: what they act on now.
    """

    def __init__(
        self,
        flight: FlightBase,
        server: viser.ViserServer,
        do: Callable[[Callable[[], None]], None],
        speed: float | None,
        change_speed: Callable[[float | None], None],
        *,
        has_plan: bool = False,
        goals: PoseGoals | None = None,
        others: Sequence[FlightBase] = (),
    ) -> None:
        self.flight, self._do, self._goals = flight, do, goals
        self._flights = (flight, *others)
        self._change_speed = change_speed
        self._buttons: list[viser.GuiButtonHandle] = []
        self._running: dict[int, Running] = {}  # by the vehicle's number
        self.is_paused = False
        self.follows = True
        drives = all(each.drives for each in self._flights)
        self.lines: tuple[str, ...] = (f"click on the ground to {'drive' if drives else 'fly'} there",)
        if others:
            self._add_vehicles(server.gui)
        if goals is not None:
            self._add_goals(server.gui, goals)
        self._add_commands(server.gui, has_plan=has_plan, drives=drives)
        self._add_pace(server.gui, speed)
        self._add_trouble(server.gui)
        server.scene.on_click()(self._clicked)

    def _add_pace(self, gui: viser.GuiApi, begin: float | None) -> None:
        with gui.add_folder("Time and view"):
            pause = gui.add_checkbox("Pause", initial_value=False)
            names = {value: name for name, value in SPEEDS.items()}
            speed = gui.add_dropdown("Pace", tuple(SPEEDS), initial_value=names.get(begin, "1 x"))
            follow = gui.add_checkbox("Camera follows", initial_value=True)

        @pause.on_update
        def _(_: Any) -> None:
            self.is_paused = bool(pause.value)

        @speed.on_update
        def _(_: Any) -> None:
            if speed.value in SPEEDS:
                chosen = SPEEDS[speed.value]
                self._do(lambda: self._change_speed(chosen))

        @follow.on_update
        def _(_: Any) -> None:
            self.follows = follow.value

    def disable(self) -> None:
        """Nothing can be clicked any more."""
        for button in self._buttons:
            button.disabled = True

    def _add_vehicles(self, gui: viser.GuiApi) -> None:
        """A chooser of whom everything else is for."""
        flights = {f"{each.drone.system_id} {each.airframe.name}": each for each in self._flights}
        chooser = gui.add_dropdown("Vehicle", tuple(flights))

        @chooser.on_update
        def _(_: Any) -> None:
            if chooser.value in flights:
                self.flight = flights[chooser.value]

    def _add_commands(self, gui: viser.GuiApi, *, has_plan: bool, drives: bool) -> None:
        with gui.add_folder("Vehicle"):
            if not drives:
                self._height = gui.add_slider(
                    "Height of gotos", min=LEAST_HEIGHT_M, max=HEIGHT_MAX_M, step=0.5, initial_value=CLIMB_M
                )
                self._add_command(gui, "Take off", self._take_off)
            self._add_command(gui, "Hold", _hold)
            self._add_command(gui, "Return", _return)
            if not drives:
                self._add_command(gui, "Land", _land)
            if has_plan:
                self._add_command(gui, "Drive the mission" if drives else "Fly the mission", self._fly_mission)
            if self.flight.owner is not None:
                self._add_command(gui, "Follow", self._follow)
            self._add_button(gui, "Restart", self._restart)
            if any(each.hand is not None for each in self._flights):
                self._add_button(gui, "Throw", self._throw)
            if drives:
                self._add_modes(gui)

    def _throw(self) -> None:
        hand = self.flight.hand
        is_thrown = hand is not None and hand.throw()
        self._say("thrown" if is_thrown else "nobody holds it")

    def _add_goals(self, gui: viser.GuiApi, goals: PoseGoals) -> None:
        with gui.add_folder("The policy drives to"):
            for name, pose in goals.named:
                self._add_command(gui, name, lambda drone, pose=pose: self._go(drone, goals, pose))  # type: ignore[misc]

    def _add_modes(self, gui: viser.GuiApi) -> None:
        """A chooser of all modes, as ground stations have one."""
        vehicle = class_of(self.flight.airframe).vehicle
        dialect = PX4.of_vehicle(vehicle.modes, vehicle.ardupilot)  # the script's, whatever ground stations hear
        numbers = {row.name: dialect.custom_mode(row.mode) for row in dialect.modes if row.is_selectable}
        chooser = gui.add_dropdown("Mode", tuple(numbers), initial_value="Hold")

        @chooser.on_update
        def _(_: Any) -> None:
            if chooser.value in numbers:
                name, number = chooser.value, numbers[chooser.value]
                self._do(lambda: self._start(f"mode {name}", lambda drone: drone.choose_mode(number, name)))

    def _add_command(self, gui: viser.GuiApi, name: str, script: Callable[[Drone], Coroutine[Any, Any, None]]) -> None:
        self._add_button(gui, name, lambda: self._start(name, script))

    def _add_button(self, gui: viser.GuiApi, name: str, task: Callable[[], None]) -> None:
        button = gui.add_button(name)
        button.on_click(lambda _: self._do(task))
        self._buttons.append(button)

    def _add_trouble(self, gui: viser.GuiApi) -> None:
        config = self.flight.config
        with gui.add_folder("Trouble"):
            wind = gui.add_slider("Wind [m/s]", min=0.0, max=WIND_MAX_M_S, step=0.5, initial_value=config.wind_m_s)
            wind_from = gui.add_slider("from [deg]", min=0.0, max=360.0, step=5.0, initial_value=config.wind_from_deg)
            numbers = tuple(str(i + 1) for i in range(self.flight.controller.state.motor_count))
            motor = gui.add_dropdown("Motor", numbers)
            kill = gui.add_button("Kill the motor", color="red")
            repair = gui.add_button("Repair all motors")
            self._buttons += [kill, repair]

        def blow(_: Any) -> None:
            speed_m_s, from_deg = within(wind.value, 0.0, WIND_MAX_M_S), within(wind_from.value, 0.0, 360.0)
            self._do(lambda: self._blow(speed_m_s, from_deg))

        wind.on_update(blow)
        wind_from.on_update(blow)

        @kill.on_click
        def _(_: Any) -> None:
            if motor.value in numbers:
                number = int(motor.value)
                self._do(lambda: self._break(number, Failure.OFF, f"motor {number} is off"))

        @repair.on_click
        def _(_: Any) -> None:
            self._do(lambda: self._break(0, Failure.OK, "all motors run"))

    # On the flight's thread

    def _blow(self, speed_m_s: float, from_deg: float) -> None:
        for flight in self._flights:
            flight.set_wind(speed_m_s, from_deg)

    def _break(self, motor: int, failure: Failure, text: str) -> None:
        self.flight.injector.inject(Unit.MOTOR, failure, motor)
        self._say(text)

    def _start(self, name: str, script: Callable[[Drone], Coroutine[Any, Any, None]]) -> None:
        """Runs a script; the one that a click has started before is given up."""
        drone = self.flight.drone
        if drone.system_id in self._running:
            self._running[drone.system_id].cancel()
        self._running[drone.system_id] = drone.start(self._reported(drone, name, script))

    async def _reported(self, drone: Drone, name: str, script: Callable[[Drone], Coroutine[Any, Any, None]]) -> None:
        if len(self._flights) > 1:
            name = f"vehicle {drone.system_id}: {name}"
        self._say(f"{name} …")
        try:
            await script(drone)
        except ScriptError as error:
            self._say(f"{name}: {error}")
        else:
            self._say(f"{name}: done")

    def _say(self, text: str) -> None:
        self.lines = (*self.lines, text)[-_LINES:]

    @property
    def _height_m(self) -> float:
        return within(self._height.value, LEAST_HEIGHT_M, HEIGHT_MAX_M)

    def _restart(self) -> None:
        if running := self._running.get(self.flight.drone.system_id):
            running.cancel()
        self.flight.restart()
        self._say("Restart: back on the pad")

    async def _get_ready(self, drone: Drone) -> None:
        """Says at once why the vehicle cannot be armed; waits only while that may end by itself."""
        if drone.is_armed:
            return
        state, commander = self.flight.controller.state, self.flight.controller.commander
        has_crashed = self.flight.is_crashed  # it may lie upright, with nothing that the vehicle itself minds
        reasons = (("it has crashed",) if has_crashed else ()) + tuple(commander.check_arming())
        if not reasons:
            return
        why = f"cannot be armed: {', '.join(reasons)}"
        if has_crashed or state.time_us - state.boot_us > SETTLES_S * 1e6:
            raise ScriptError(why)
        self._say(f"waits: {why}")
        await drone.wait_ready(SETTLES_S)

    async def _take_off(self, drone: Drone) -> None:
        await self._get_ready(drone)
        if not drone.is_armed:
            await drone.arm()
        await drone.takeoff(self._height_m)

    async def _fly_mission(self, drone: Drone) -> None:
        await self._get_ready(drone)
        await drone.start_mission()

    async def _follow(self, drone: Drone) -> None:
        """Lets the companion on board fly, after the pilot has taken over, or from the ground."""
        if not drone.is_armed or drone.is_landed:
            await self._get_ready(drone)
            await take_off(drone)
        await drone.let_companion_fly()

    async def _go(self, drone: Drone, goals: PoseGoals, pose: Pose) -> None:
        if not drone.is_armed:
            await self._get_ready(drone)
            await drone.arm()
        await goals.go(drone, pose)

    async def _drive_to(self, drone: Drone, north_m: float, east_m: float, up_m: float) -> None:
        if not drone.is_armed:
            await self._get_ready(drone)
            await drone.arm()
        if self._goals is not None:
            await self._goals.go(drone, (north_m, east_m, nan))
        else:
            await drone.goto_ned(north_m, east_m, -up_m, acceptance_m=DRIVEN_WITHIN_M)

    async def _fly_to(self, drone: Drone, north_m: float, east_m: float, up_m: float) -> None:
        if not drone.is_armed or drone.is_landed:
            await self._take_off(drone)
        await drone.goto_ned(north_m, east_m, -up_m - self._height_m)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        """On a thread of viser's."""
        world = self.flight.world
        distance_m = world.ray_hit(event.ray_origin, event.ray_direction, FAR_M)
        if isnan(distance_m) or distance_m >= FAR_M:
            return
        north, east = (
            float(start + distance_m * along)
            for start, along in zip(event.ray_origin[:2], event.ray_direction[:2], strict=True)
        )
        if max(abs(north), abs(east)) > 0.5 * world.config.size_m:
            return
        up = float(world.height(north, east))
        name = f"go to {north:.0f} m north, {east:.0f} m east ({hypot(north, east):.0f} m from home)"
        go = self._drive_to if self.flight.drives else self._fly_to
        self._do(lambda: self._start(name, lambda drone: go(drone, north, east, up)))


async def _hold(drone: Drone) -> None:
    await drone.hold()


async def _return(drone: Drone) -> None:
    await drone.return_home()


async def _land(drone: Drone) -> None:
    await drone.land()
