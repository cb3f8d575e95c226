"""Who is judged: a scorecard is of what the policy flew, whoever takes over, breaks or restarts the vehicle."""

import pytest
from rich.console import Console

from autopilot.interface.failure_requests import Failure, Unit
from autopilot.interface.vehicle_state import Mode
from mission.follow.follow_session import finish, score_lines, watch_of
from mission.run_folder import OwnFiles
from policies.companion.engagement import Phase
from policies.tasks.follow_me.scorecard import lines, scorecard
from tests.unit.mission.follow.follow_flight import following, hide, lose


class Judged:
    """A flight that follows, and the watch that judges it from now on."""

    def __init__(self, planned_s, **changed):
        self.flight, self.companion = following(numbers={"phone_error": 0.0}, **changed)
        self.watch = watch_of(self.flight, self.companion, planned_s)
        self.watch.frame()

    def fly(self, seconds):
        end_us = self.flight.time_us + round(seconds * 1e6)
        self.flight.run(lambda f: f.time_us >= end_us, on_frame=lambda _: self.watch.frame())

    def do(self, script, seconds=20.0):
        running = self.flight.drone.start(script(self.flight.drone))
        end_us = self.flight.time_us + round(seconds * 1e6)
        self.flight.run(lambda f: running.is_done or f.time_us >= end_us, on_frame=lambda _: self.watch.frame())
        assert running.error is None, running.error

    def exit_code(self, folder, *, is_down=True, is_stopped=False):
        console = Console()
        return finish(
            self.watch,
            self.companion,
            OwnFiles(folder, console),
            console,
            is_down=is_down,
            is_stopped=is_stopped,
        )


def test_a_person_who_flies_away_and_comes_back_is_not_judged(tmp_path):
    judged = Judged(8.0)
    judged.fly(2.0)
    judged.do(hold_for_3_s)
    assert judged.watch.takeovers == ["mode Hold was chosen"]
    assert not judged.watch.is_over
    judged.do(lambda drone: drone.let_companion_fly())
    judged.fly(8.0)
    assert judged.watch.is_over
    track = judged.watch.track()
    assert track.is_whole
    assert track.planned_s == pytest.approx(judged.watch.judged_s, abs=0.2)
    assert 4.0 < track.planned_s < 5.2  # eight, less three and what the change of mode took
    assert judged.exit_code(tmp_path) == 0


def test_what_the_companion_does_by_itself_after_a_failure_is_nobodys_taking_over():
    settings = {"search_s": 2.5, "lost_s": 3.0, "return_s": 4.0}
    judged = Judged(40.0, settings=settings)
    judged.fly(1.0)
    judged.flight.injector.inject(Unit.MAGNETOMETER, Failure.OFF, 0)
    hide(judged.flight)
    lose(judged.companion, "FOLLOW_TARGET")
    judged.fly(5.5)
    assert judged.flight.controller.state.mode is Mode.HOLD
    judged.flight.injector.inject(Unit.MAGNETOMETER, Failure.OK, 0)
    judged.fly(6.0)
    assert judged.flight.controller.state.mode is Mode.RETURN
    assert not judged.flight.controller.state.is_failsafe
    assert judged.watch.takeovers == ["a failure was injected"]


async def hold_for_3_s(drone):
    await drone.hold()
    await drone.sleep(3.0)


def test_a_policy_that_gives_up_by_itself_has_not_followed_for_the_rest(tmp_path):
    judged = Judged(8.0)
    judged.fly(2.0)
    lose(judged.companion, "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "ODOMETRY", "ATTITUDE")
    judged.fly(3.0)
    assert judged.watch.is_over
    assert judged.watch.takeovers == []
    assert not judged.watch.track().is_whole
    assert judged.exit_code(tmp_path) == 1


def test_a_crash_after_a_killed_motor_is_not_the_policys(tmp_path, capsys):
    judged = Judged(20.0)
    judged.fly(2.0)
    judged.flight.injector.inject(Unit.MOTOR, Failure.OFF, 1)
    judged.fly(18.5)
    assert judged.flight.is_crashed
    assert judged.watch.is_over
    assert judged.watch.takeovers[0] == "a failure was injected"
    assert judged.exit_code(tmp_path, is_down=False) == 0
    assert "judged: the 2.0 s that the policy flew; for 18.0 s a failure was injected" in capsys.readouterr().out


def test_a_vehicle_put_back_on_its_pad_is_whole_and_may_follow_again(tmp_path):
    judged = Judged(200.0)
    judged.fly(2.0)
    judged.flight.injector.inject(Unit.MOTOR, Failure.OFF, 1)
    judged.fly(6.0)
    assert judged.flight.is_crashed
    judged.flight.restart()
    assert not judged.flight.is_crashed
    assert not judged.flight.controller.state.is_armed
    judged.fly(1.0)
    assert not judged.watch.is_over
    judged.do(take_off_and_follow, 60.0)
    judged.fly(3.0)
    assert judged.companion.phase is Phase.FLYING
    assert judged.watch.judged_s == pytest.approx(5.0, abs=0.6)
    assert not judged.watch.so_far().is_collided.any()
    assert judged.flight.controller.state.battery_remaining > 0.95


def test_a_policy_that_gives_up_after_a_restart_has_not_followed_for_the_rest(tmp_path):
    judged = Judged(60.0)
    judged.flight.restart()
    judged.fly(1.0)
    judged.do(take_off_and_follow, 60.0)
    judged.fly(2.0)
    assert judged.companion.phase is Phase.FLYING
    lose(judged.companion, "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED", "ODOMETRY", "ATTITUDE")
    judged.fly(3.0)
    assert judged.watch.takeovers == ["the vehicle was restarted"]
    assert judged.watch.is_over
    assert judged.exit_code(tmp_path) == 1


async def take_off_and_follow(drone):
    await drone.wait_ready()
    await drone.arm()
    await drone.takeoff(2.5)
    await drone.let_companion_fly()


def test_a_flight_stopped_by_its_user_is_judged_as_far_as_it_went(tmp_path):
    judged = Judged(60.0)
    judged.fly(4.0)
    assert judged.exit_code(tmp_path, is_down=False, is_stopped=True) == 0


def test_the_live_page_shows_the_scorecards_own_figures():
    judged = Judged(4.0)
    judged.fly(2.0)
    judged.do(hold_for_3_s)
    assert judged.watch.is_over
    _, shown = score_lines(judged.watch, judged.companion)
    card = dict(lines(scorecard([judged.watch.track()])))
    for label in ("within 1-3 m", "owner in view", "median distance", "collision (CR)"):
        assert f"{label} {card[label]}" in shown
