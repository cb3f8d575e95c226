"""Outputs that are switched to and fro."""

import pytest

from autopilot.interface.vehicle_state import Verdict
from autopilot.payload.aux_outputs import NEVER_US, REPEAT_RELAY, REPEAT_SERVO, SET_RELAY, SET_SERVO, AuxOutputs
from tests.unit.autopilot.mavlink.rig import flying_state

FRAME_US = 20_000


class Bench:
    """Outputs whose frames run when they are due."""

    def __init__(self):
        self.state = flying_state()
        self.outputs = AuxOutputs(self.state)

    def run(self, command, *params):
        values = (*params, *(0.0,) * (4 - len(params)))
        return self.outputs.run(command, values, 0.0, 0.0, 0.0).verdict

    def follow(self, seconds, read):
        """What is read over a time, each value once until it changes."""
        seen = [read()]
        for _ in range(round(seconds * 1e6 / FRAME_US)):
            self.state.time_us += FRAME_US
            if self.state.time_us >= self.outputs.due_us:
                self.outputs.frame()
            if read() != seen[-1]:
                seen.append(read())
        return seen


def test_relay_is_switched_to_and_fro_and_is_as_before():
    bench = Bench()
    bench.run(SET_RELAY, 1.0, 1.0)
    assert bench.run(REPEAT_RELAY, 1.0, 2.0, 1.0) is Verdict.ACCEPTED
    assert bench.follow(5.0, lambda: bench.state.relays) == [0, 2, 0, 2]
    assert bench.outputs.due_us == NEVER_US


def test_servo_moves_away_and_back():
    bench = Bench()
    assert bench.run(REPEAT_SERVO, 10.0, 1900.0, 2.0, 1.0) is Verdict.ACCEPTED
    assert bench.follow(0.4, lambda: bench.state.aux_pulses_us[1]) == [1900]
    assert bench.follow(5.0, lambda: bench.state.aux_pulses_us[1]) == [1900, 1500, 1900, 1500]


def test_setting_an_output_ends_its_repeats():
    bench = Bench()
    bench.run(REPEAT_SERVO, 10.0, 1900.0, 5.0, 1.0)
    bench.run(SET_SERVO, 10.0, 1100.0)
    assert bench.follow(5.0, lambda: bench.state.aux_pulses_us[1]) == [1100]


@pytest.mark.parametrize(
    ("command", "params"),
    [
        (REPEAT_RELAY, (9.0, 2.0, 1.0)),
        (REPEAT_RELAY, (0.0, 0.0, 1.0)),
        (REPEAT_RELAY, (0.0, 2.0, 0.0)),
        (REPEAT_RELAY, (float("nan"), 2.0, 1.0)),
        (REPEAT_RELAY, (0.5, 2.0, 1.0)),
        (REPEAT_SERVO, (3.0, 1900.0, 2.0, 1.0)),
        (REPEAT_SERVO, (10.0, 9000.0, 2.0, 1.0)),
        (REPEAT_SERVO, (10.0, 1900.0, float("nan"), 1.0)),
        (REPEAT_SERVO, (10.0, 1900.0, 2.0, float("inf"))),
    ],
)
def test_what_cannot_be_repeated_is_refused(command, params):
    bench = Bench()
    before = (bench.state.relays, bench.state.aux_pulses_us)
    assert bench.run(command, *params) is Verdict.DENIED
    assert (bench.state.relays, bench.state.aux_pulses_us) == before
