"""The loop in single launches, tick by tick: any engine with any board.

What sim/advance.py fuses into one launch is here four: the air and the commands as they reach the motors, the engine,
the sensors, the board. With our own engine and board both rigs agree bit for bit; it is there for those of others.
"""

from collections.abc import Callable, Iterator
from typing import Any, cast

import warp as wp

from autopilot.ports import Samples
from common.kernels import SUBSTEPS, TICK_S, vec8
from common.rng import draw_tick
from sim.boards.board import Board
from sim.boards.own import OwnBoard
from sim.engines.engine import Engine, FastEngine
from sim.engines.native import NativeEngine
from sim.faults import weakened
from sim.rig import Rig
from sim.sensors.sensors import Faults, SensorModel, SensorState, sense
from sim.truth import Truth
from sim.wind import WindModel, WindState, wind_step
from sim.world.world import World, ground_height, world_at

wp.set_module_options({"enable_backward": False})


@wp.kernel(enable_backward=False)
def blow(
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    models: wp.array(dtype=WindModel),
    truths: wp.array(dtype=Truth),
    faults: wp.array(dtype=Faults),
    board_commands: wp.array(dtype=vec8),
    seeds: wp.array(dtype=int),
    ticks: wp.array(dtype=wp.int64),
    winds: wp.array(dtype=WindState),
    wind_ned: wp.array(dtype=wp.vec3),
    commands: wp.array(dtype=vec8),
) -> None:
    """The air at each vehicle, and what its motors get of the commands."""
    i = wp.tid()
    pos_ned = truths[i].pos_ned
    height = -pos_ned[2] - ground_height(worlds[i_world[i]], pos_ned[0], pos_ned[1])
    count = draw_tick(ticks[i])
    wind = wind_step(models[i], winds[i], truths[i].vel_ned, height, seeds[i], i, count, TICK_S)
    winds[i] = wind
    wind_ned[i] = wind.wind_ned
    commands[i] = weakened(board_commands[i], faults[i].motor_loss)


@wp.kernel(enable_backward=False)
def weaken(
    faults: wp.array(dtype=Faults), board_commands: wp.array(dtype=vec8), commands: wp.array(dtype=vec8)
) -> None:
    """What motors get of commands that have come between two ticks."""
    i = wp.tid()
    commands[i] = weakened(board_commands[i], faults[i].motor_loss)


@wp.kernel(enable_backward=False)
def sense_all(
    worlds: wp.array(dtype=World),
    i_world: wp.array(dtype=int),
    models: wp.array(dtype=SensorModel),
    faults: wp.array(dtype=Faults),
    truths: wp.array(dtype=Truth),
    seeds: wp.array(dtype=int),
    ticks: wp.array(dtype=wp.int64),
    states: wp.array(dtype=SensorState),
    samples: wp.array(dtype=Samples),
) -> None:
    """The sensors after a tick."""
    i = wp.tid()
    world = world_at(worlds[i_world[i]], draw_tick(ticks[i]))
    state = sense(models[i], states[i], faults[i], truths[i], world, seeds[i], i, ticks[i])
    states[i] = state
    samples[i] = state.samples


@wp.kernel(enable_backward=False)
def count_on(ticks: wp.array(dtype=wp.int64)) -> None:
    """The tick is over."""
    i = wp.tid()
    ticks[i] = ticks[i] + wp.int64(1)


@wp.kernel(enable_backward=False)
def forget_commands(is_chosen: wp.array(dtype=int), commands: wp.array(dtype=vec8)) -> None:
    """A board that has just been powered on commands nothing."""
    i = wp.tid()
    if is_chosen[i] != 0:
        commands[i] = vec8()


class SteppedRig(Rig):
    """A rig whose bodies an engine moves and whose vehicles a board flies.

    Args:
        engine: makes the engine for this rig.
        board: makes the board.
        arguments: those of `Rig`; the flight controller is given samples, never the truth.
    """

    def __init__(
        self,
        *arguments: Any,
        engine: Callable[[Rig], Engine] = NativeEngine,
        board: Callable[[Rig], Board] = OwnBoard,
        **options: Any,
    ) -> None:
        self._make_engine, self._make_board = engine, board
        super().__init__(*arguments, **options)

    def compose(self) -> None:
        count, device = self.vehicle_count, self.device
        self._samples = wp.zeros(count, dtype=Samples, device=device)
        self._board_commands = wp.zeros(count, dtype=vec8, device=device)
        self._motor_commands = wp.zeros(count, dtype=vec8, device=device)
        self._launches: list[Any] = []
        self._wind_ned = wp.zeros(count, dtype=wp.vec3, device=device)
        self._engine, self._board = self._make_engine(self), self._make_board(self)
        if self._board.is_fast and not hasattr(self._engine, "substep"):
            raise ValueError("this autopilot flies such a vehicle at 1,000 Hz, for which there is the native engine")
        self._fast_engine = cast(FastEngine, self._engine)

    @property
    def board_commands(self) -> Any:
        """What the board wants of the actuators, array of vec8, (vehicles,)."""
        return self._board_commands

    def boot_marked(self, marks: Any) -> None:
        self._engine.boot(marks)
        self.power_on(marks)

    def power_on(self, marks: Any) -> None:
        super().power_on(marks)
        self._board.boot(marks)
        inputs = [marks, self._board_commands]
        wp.launch(forget_commands, self.vehicle_count, inputs, device=self.device)

    def prepare(self, tick_count: int) -> list[Any]:  # noqa: ARG002  (any number of ticks is the same launches)
        return []

    def advance(self, tick_count: int) -> None:
        for _ in self.advancing(tick_count):
            pass

    def advancing(self, tick_count: int) -> Iterator[None]:
        """As `advance`, with a pause each time the board has been given its samples: others can go on meanwhile."""
        self.rows.send()
        for _ in range(tick_count):
            yield from self._tick()
        self.rows.fetch()

    def _tick(self) -> Iterator[None]:
        blown, weakened_again, sensed, counted = self._launches or self._record_tick()
        blown.launch()
        if self._board.is_fast:
            for _ in range(SUBSTEPS):
                self._fast_engine.substep(self._motor_commands, self._wind_ned)
                yield from self._exchange()
                weakened_again.launch()
            sensed.launch()
        else:
            self._engine.step(self._motor_commands, self._wind_ned)
            sensed.launch()
            yield from self._exchange()
        counted.launch()

    def _exchange(self) -> Iterator[None]:
        self._board.give(self._samples, self.arrays.truth)
        yield
        self._board.take(self._board_commands)

    def _record_tick(self) -> list[Any]:
        """The launches of a tick but engine and board, made once: to pack their arguments takes as long as they do."""
        a, where = self.arrays, [self.arrays.worlds, self.arrays.i_world]
        air = [self._board_commands, a.seed, a.tick, a.wind, self._wind_ned, self._motor_commands]
        inputs = {
            blow: [*where, a.wind_model, a.truth, a.faults, *air],
            weaken: [a.faults, self._board_commands, self._motor_commands],
            sense_all: [*where, a.sensor_model, a.faults, a.truth, a.seed, a.tick, a.sensors, self._samples],
            count_on: [a.tick],
        }
        dim, device = self.vehicle_count, self.device
        self._launches = [wp.launch(k, dim, of, device=device, record_cmd=True) for k, of in inputs.items()]
        return self._launches
