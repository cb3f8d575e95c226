"""Commands for what the vehicle carries reach the parts that take them."""

from math import nan

from autopilot.interface.vehicle_state import ACCEPTED, Reply, Verdict
from autopilot.payload.payloads import Payloads

FREE = (nan, nan, nan, nan)


class Part:
    def __init__(self, commands, reply=ACCEPTED):
        self.commands, self.reply, self.done = commands, reply, []

    def takes(self, command):
        return command in self.commands

    def run(self, command, params, x, y, z):
        self.done.append((command, params[0], x, y, z))
        return self.reply


def test_command_reaches_every_part_that_takes_it():
    camera, gimbal, payloads = Part({203, 195}), Part({195}), Payloads()
    payloads.add(camera)
    payloads.add(gimbal)
    assert payloads.takes(203)
    assert not payloads.takes(211)
    assert payloads.run(195, (1.0, nan, nan, nan), 47.0, 8.0, 500.0) is ACCEPTED
    assert payloads.run(203, (2.0, nan, nan, nan), 0.0, 0.0, 0.0) is ACCEPTED
    assert camera.done == [(195, 1.0, 47.0, 8.0, 500.0), (203, 2.0, 0.0, 0.0, 0.0)]
    assert gimbal.done == [(195, 1.0, 47.0, 8.0, 500.0)]


def test_command_that_no_part_takes_is_unsupported_and_a_refusal_is_passed_on():
    payloads = Payloads()
    assert payloads.run(211, FREE, nan, nan, nan).verdict is Verdict.UNSUPPORTED
    busy = Reply(Verdict.TEMPORARILY_REJECTED, "busy")
    payloads.add(Part({2000}))
    payloads.add(Part({2000}, busy))
    assert payloads.run(2000, FREE, nan, nan, nan) is busy
