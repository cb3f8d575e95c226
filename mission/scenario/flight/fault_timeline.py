"""Makes the faults of a scenario happen, and end: at their time, or when their condition first holds."""

from collections.abc import Sequence

from mission.console.option_checks import UserError
from mission.scenario.flight.building import set_charge
from mission.scenario.flight.quantities import hold_now
from mission.scenario.flight.run import Run, VehicleRun
from mission.scenario.parts.conditions import Term, terms_of
from mission.scenario.parts.faults import Fault
from sim.faults import set_fault

LOOK_US = 100_000  # between looks at conditions


class FaultTimeline:
    """The faults of a run; call `frame` after each frame.

    Args:
        run: what they happen to.
        faults: which.

    Raises:
        UserError: a part is not there to fail.
    """

    def __init__(self, run: Run, faults: Sequence[Fault]) -> None:
        self._run = run
        self._timed = sorted((fault for fault in faults if fault.at is not None), key=lambda fault: fault.at or 0.0)
        self._awaited: list[tuple[Fault, tuple[Term, ...]]] = [
            (fault, terms_of(fault.when)) for fault in faults if fault.when is not None
        ]
        self._ending: list[tuple[int, Fault]] = []  # [us]
        for fault in faults:
            self._check(fault)

    def add(self, fault: Fault) -> None:
        """One more, at its time.

        Raises:
            UserError: the part is not there to fail.
        """
        self._check(fault)
        self._timed = sorted([*self._timed, fault], key=lambda each: each.at or 0.0)

    def frame(self, time_us: int) -> None:
        """Begins and ends what is due."""
        while self._timed and time_us >= (self._timed[0].at or 0.0) * 1e6:
            self._begin(self._timed.pop(0), time_us)
        if self._awaited and time_us % LOOK_US == 0:
            due = [each for each in self._awaited if hold_now(self._vehicle(each[0]).flight, each[1])]
            self._awaited = [each for each in self._awaited if each not in due]
            for fault, _ in due:
                self._begin(fault, time_us)
        for end in [end for end in self._ending if time_us >= end[0]]:
            self._ending.remove(end)
            self._change(end[1], is_on=False)

    @property
    def left(self) -> list[Fault]:
        """Those that have not happened."""
        return [*self._timed, *(fault for fault, _ in self._awaited)]

    def _vehicle(self, fault: Fault) -> VehicleRun:
        return self._run.vehicles[fault.vehicle - 1]

    def _begin(self, fault: Fault, time_us: int) -> None:
        self._change(fault, is_on=True)
        if fault.mark:
            self._run.mark(fault.mark)
        if fault.for_s is not None:
            self._ending.append((time_us + round(fault.for_s * 1e6), fault))

    def _check(self, fault: Fault) -> None:
        flight = self._vehicle(fault).flight
        motors = flight.controller.state.motor_count
        if fault.motor is not None and fault.motor.number > motors:
            raise UserError(f"faults: {flight.config.airframe} has motors 1 to {motors}, not {fault.motor.number}")
        if fault.link is not None and fault.link.name == "ground_station" and not self._run.stations:
            raise UserError("faults: link ground_station: the scenario needs has_ground_station: true")
        if fault.link is not None and fault.link.name == "companion" and self._run.companion is None:
            raise UserError("faults: link companion: the vehicle has no policy")

    def _change(self, fault: Fault, *, is_on: bool) -> None:
        flight = self._vehicle(fault).flight
        if fault.sensor is not None:
            mode = fault.sensor.mode if is_on else "none"
            set_fault(flight.rig.rows["faults"][0], fault.sensor.name, mode, fault.sensor.magnitude or 0.0)
        if fault.motor is not None:
            flight.injector.weaken(fault.motor.number - 1, fault.motor.power if is_on else 1.0)
        if fault.battery is not None:
            set_charge(flight, fault.battery.remaining)
        if fault.link is not None:
            self._cut(fault, is_cut=is_on)
        if fault.wind is not None:
            self._blow(fault, is_on=is_on)

    def _cut(self, fault: Fault, *, is_cut: bool) -> None:
        flight, name = self._vehicle(fault).flight, fault.link.name if fault.link else ""
        if name == "sticks":
            flight.cut_sticks(is_cut=is_cut)
        elif name == "ground_station":
            self._run.stations[fault.vehicle - 1].is_cut = is_cut
        elif is_cut:
            flight.computers.remove(self._run.companion)
        else:
            flight.computers.append(self._run.companion)

    def _blow(self, fault: Fault, *, is_on: bool) -> None:
        """The wind of the fault, or that of the scenario again, over all vehicles: it is one air."""
        wind = fault.wind if is_on and fault.wind is not None else self._run.scenario.wind
        for vehicle in self._run.vehicles:
            if wind.turbulence_m_s is None:
                vehicle.flight.set_wind(wind.speed_m_s, wind.from_deg)
            else:
                vehicle.flight.set_air(wind.speed_m_s, wind.from_deg, wind.turbulence_m_s)
