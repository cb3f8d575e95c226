"""The test rig: world, vehicles and their flight controllers' kernel part, advanced together.

In: setpoints. Out: the true state, the samples and the estimates. The host reads and writes them as `rows`; kernels of
tasks take `arrays`, whose rows they read, and of which they write setpoints alone. One call of `advance` is one launch
per thread, for one vehicle or thousands.
"""

from math import radians
from typing import Any

import numpy as np
import warp as wp

from autopilot.advance import autopilot_kernels
from autopilot.control.law import ControlLaw
from autopilot.estimator.ekf import make_ekf
from autopilot.estimator.params import estimator_fields
from autopilot.ports import Setpoint
from common.airframe import Airframe
from common.geodesy import GeoPoint
from common.geomagnetic import field_ned_gauss
from common.params import ParameterTable
from common.records import assign_rows
from common.warp_start import start_warp
from sim.advance import advance_kernel, rig_kernels
from sim.bodies.body import DEFAULT_BODY, DEFAULT_LAW, Body
from sim.launches import Workers
from sim.rows import HostRows
from sim.sensors.sensors import Faults, SensorModel, SensorState
from sim.truth import Truth
from sim.wind import WindModel, WindState
from sim.world.batch import WorldBatch
from sim.world.world import World, WorldMap

Rows = np.ndarray[Any, Any]
Snapshot = list[Rows]
"""A copy of every array that has a row per vehicle."""


class Rig:
    """Vehicles of one airframe, all in one world or each in its own.

    Args:
        airframe: the vehicle.
        world: the ground they fly over, its origin the home; of a batch, vehicle i is in world i.
        sensor_model: noise and delays of the sensors.
        wind_model: the air.
        home: the origin of ned.
        vehicle_count: rows of every array.
        seed: seeds all noise; vehicle i draws from the stream (seed, i).
        has_estimator: False gives the controller the true state (training only).
        threads: the vehicles are split into as many launches; the results do not depend on it.
        device: a Warp device.
        has_mirrors: the host sees copies of the rows, as those of a GPU.
        body: what is moved.
        law: what flies it.
        start_ne_m: north and east of where the vehicles boot [m].
        heading_deg: where their noses point then, from north, clockwise.
    """

    def __init__(
        self,
        airframe: Airframe,
        world: WorldMap | WorldBatch,
        sensor_model: SensorModel,
        wind_model: WindModel,
        *,
        home: GeoPoint,
        vehicle_count: int = 1,
        seed: int = 0,
        has_estimator: bool = True,
        threads: int = 1,
        device: str = "cpu",
        has_mirrors: bool = False,
        body: Body = DEFAULT_BODY,
        law: ControlLaw = DEFAULT_LAW,
        start_ne_m: tuple[float, float] = (0.0, 0.0),
        heading_deg: float = 0.0,
    ) -> None:
        start_warp()
        self._start = wp.vec2(*start_ne_m), radians(heading_deg)
        self.body, self.law = body, law
        self._kernels = rig_kernels(body, law)
        self.vehicle_count = vehicle_count
        self.device = device
        self.arrays: Any = self._kernels.Arrays()
        self.world = world  # holds the arrays that the kernels' structs point into
        self.arrays.worlds, self.arrays.i_world = self._worlds(world)
        self.arrays.tick = wp.zeros(vehicle_count, dtype=wp.int64, device=device)
        self.arrays.seed = wp.full(vehicle_count, seed, dtype=int, device=device)
        self.arrays.model = self._rows(body.Model, body.model(airframe, home.alt_m))
        self.arrays.body = self._rows(body.State, body.State())
        self.arrays.truth = self._rows(Truth, Truth())
        self.arrays.wind_model = self._rows(WindModel, wind_model)
        self.arrays.wind = self._rows(WindState, WindState())
        self.arrays.sensor_model = self._rows(SensorModel, sensor_model)
        self.arrays.sensors = self._rows(SensorState, SensorState())
        self.arrays.faults = self._rows(Faults, Faults())
        self.arrays.autopilot = self._autopilot(airframe)
        self._field_ned_gauss = field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m)
        self.rows = HostRows(self.arrays, is_mirrored=has_mirrors or wp.get_device(device).is_cuda)
        self._commands: dict[int, list[Any]] = {}
        self._kernel = advance_kernel(body, law, has_estimator=has_estimator)
        self._workers = Workers(vehicle_count, threads)
        self.compose()
        self.boot()

    @property
    def truth(self) -> Any:
        """`Truth` of each vehicle, an array of the device, (vehicles,)."""
        return self.arrays.truth

    @property
    def models(self) -> Any:
        """The body's `Model` of each vehicle, an array of the device, (vehicles,)."""
        return self.arrays.model

    @property
    def setpoints(self) -> Any:
        """`Setpoint` of each vehicle, an array of the device, (vehicles,)."""
        return self.arrays.autopilot.setpoint

    def truth_row(self, i_vehicle: int = 0) -> Any:
        """The `Truth` of one vehicle now, a structured NumPy value."""
        return self.arrays.truth[i_vehicle : i_vehicle + 1].numpy()[0]

    def set_air(self, wind_model: WindModel) -> None:
        """From now on all vehicles fly in this air."""
        self.arrays.wind_model.fill_(wind_model)

    def forget_impacts(self) -> None:
        """Only what the vehicles touch from now on counts."""
        wp.launch(self._kernels.forget_all_impacts, dim=self.vehicle_count, inputs=[self.arrays], device=self.device)
        self.rows.fetch()

    def advance(self, tick_count: int) -> None:
        """Advances every vehicle by `tick_count` ticks of 4 ms."""
        self.rows.send()
        commands = self.prepare(tick_count)
        if len(commands) == 1:
            commands[0].launch()
        else:
            self._workers.run(lambda k: commands[k].launch())
        self.rows.fetch()

    def prepare(self, tick_count: int) -> list[Any]:
        """Compiles or loads the kernel for `advance(tick_count)`, so that the first advance takes no longer."""
        commands = self._commands.get(tick_count)
        if commands is None:
            commands = self._commands[tick_count] = self._record(tick_count)
        return commands

    def boot(self, chosen: Rows | None = None) -> None:
        """Powers vehicles on, on the ground where they boot; `chosen` marks them, shape (vehicles,), None for all."""
        mask = np.ones(self.vehicle_count, dtype=np.int32) if chosen is None else chosen.astype(np.int32)
        marks = wp.array(mask, dtype=int, device=self.device)
        self.boot_marked(marks)
        self.rows.fetch()

    def compose(self) -> None:
        """Makes what else the loop is composed of, before the first boot: nothing, where it is one launch."""

    def boot_marked(self, marks: Any) -> None:
        """Boots the vehicles whose mark is not 0; marks: array of int, (vehicles,)."""
        self.place(marks)
        self.power_on(marks)

    def place(self, marks: Any) -> None:
        """Puts marked vehicles on the ground where they boot, at rest and with a full battery."""
        inputs = [self.arrays, marks, *self._start]
        wp.launch(self._kernels.place, dim=self.vehicle_count, inputs=inputs, device=self.device)

    def power_on(self, marks: Any) -> None:
        """Powers the sensors and flight controllers of marked vehicles off and on, wherever they are."""
        wp.launch(self._kernels.power_on, dim=self.vehicle_count, inputs=[self.arrays, marks], device=self.device)

    def snapshot(self) -> Snapshot:
        """A copy of all rows, to be restored in this rig or in another of as many vehicles."""
        return [array.numpy().copy() for array in row_arrays(self.arrays)]

    def restore(self, snapshot: Snapshot) -> None:
        """Puts every vehicle where the snapshot found it; of some vehicles, `sim.restore.RowRestore` does it."""
        for array, rows in zip(row_arrays(self.arrays), snapshot, strict=True):
            assign_rows(array, rows)
        self.rows.fetch()

    def reboot(self, i_vehicle: int = 0) -> None:
        """Powers the sensors and the flight controller of one vehicle off and on, wherever it is."""
        marks = np.zeros(self.vehicle_count, dtype=np.int32)
        marks[i_vehicle] = 1
        self.power_on(wp.array(marks, dtype=int, device=self.device))
        self.rows.fetch()

    def load_parameters(self, table: ParameterTable) -> None:
        """Gives every flight controller the values of a parameter table, and the local magnetic field."""
        estimator = estimator_fields(table) | {"earth_field_ned_gauss": self._field_ned_gauss}
        self._write_rows(self.arrays.autopilot.ekf.params, estimator)
        self._write_rows(self.arrays.autopilot.control_params, table.fields(self.law.parameters))

    def _write_rows(self, array: Any, fields: dict[str, Any]) -> None:
        rows = array.numpy()
        for name, value in fields.items():
            rows[name] = value
        if array.device.is_cuda:
            array.assign(rows)

    def _record(self, tick_count: int) -> list[Any]:
        return [
            wp.launch(
                self._kernel,
                dim=count,
                inputs=[self.arrays, first, tick_count],
                device=self.device,
                record_cmd=True,
            )
            for first, count in self._workers.chunks
        ]

    def _rows(self, struct_type: Any, value: Any) -> Any:
        return wp.array([value] * self.vehicle_count, dtype=struct_type, device=self.device)

    def _worlds(self, world: WorldMap | WorldBatch) -> tuple[Any, Any]:
        """The worlds, and which of them each vehicle is in."""
        if isinstance(world, WorldMap):
            kernels = wp.array([world.kernel], dtype=World, device=self.device)
            return kernels, wp.zeros(self.vehicle_count, dtype=int, device=self.device)
        if world.count != self.vehicle_count:
            raise ValueError(f"{self.vehicle_count} vehicles need as many worlds, not {world.count}")
        return world.kernels, wp.array(np.arange(world.count), dtype=int, device=self.device)

    def _autopilot(self, airframe: Airframe) -> Any:
        law = self.law
        autopilot: Any = autopilot_kernels(law).Arrays()
        autopilot.ekf = make_ekf(self.vehicle_count, self.device)
        autopilot.control = self._rows(law.State, law.State())
        autopilot.control_params = self._rows(law.Params, law.default_params())
        autopilot.airframe = self._rows(law.Airframe, law.airframe_row(airframe))
        autopilot.setpoint = self._rows(Setpoint, Setpoint())
        return autopilot


def row_arrays(arrays: Any) -> list[Any]:
    """Every array that holds the state of vehicles, of a struct and of those in it, in the order of declaration.

    The worlds are left out, and which a vehicle is in: a vehicle restored from elsewhere stays in its own.
    """
    found = []
    for name in arrays.cls.__annotations__:
        member = getattr(arrays, name)
        if name in ("worlds", "i_world"):
            continue
        if isinstance(member, wp.array):
            found.append(member)
        else:
            found.extend(row_arrays(member))
    return found
