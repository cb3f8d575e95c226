"""Makes the faults of a scenario happen, and end: at their time, or when their condition first holds.

Of several faults of one thing the one that began last counts; when it ends, the one before does again.
"""

from collections.abc import Sequence
from math import inf

from mission.scenario.flight.building import set_charge
from mission.scenario.flight.checking import check_faults
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
        self._active: list[tuple[Fault, float]] = []  # as they began, and when each ends [us]
        self._check(faults)

    def add(self, fault: Fault) -> None:
        """One more, at its time.

        Raises:
            UserError: the part is not there to fail.
        """
        self._check([fault])
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
        for each in [each for each in self._active if time_us >= each[1]]:
            self._end(each)

    @property
    def left(self) -> list[Fault]:
        """Those that have not happened."""
        return [*self._timed, *(fault for fault, _ in self._awaited)]

    def _vehicle(self, fault: Fault) -> VehicleRun:
        return self._run.vehicles[fault.vehicle - 1]

    def _begin(self, fault: Fault, time_us: int) -> None:
        if fault.link is None or not self._same(fault):
            self._change(fault, is_on=True)
        self._run.note(f"fault: {fault.in_words}", fault.vehicle)
        if fault.mark:
            self._run.mark(fault.mark)
        end_us = inf if fault.for_s is None else time_us + fault.for_s * 1e6
        self._active.append((fault, end_us))

    def _end(self, ended: tuple[Fault, float]) -> None:
        """What it changed is as before, or as another fault of the same thing has it."""
        self._active.remove(ended)
        fault = ended[0]
        left = self._same(fault)
        if not left:
            self._change(fault, is_on=False)
        elif fault.link is None:
            self._change(left[-1], is_on=True)
        self._run.note(f"over: {fault.in_words}", fault.vehicle)

    def _same(self, fault: Fault) -> list[Fault]:
        """Those of the same thing that have begun and not ended."""
        return [other for other, _ in self._active if other.thing == fault.thing]

    def _check(self, faults: Sequence[Fault]) -> None:
        asked = self._run.scenario.model_copy(update={"faults": tuple(faults)})
        check_faults(asked, [vehicle.flight.config for vehicle in self._run.vehicles])

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
