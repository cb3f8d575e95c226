"""What it may do by itself once control has gone: home without the owner, on after a lost position, over no pilot."""

import pytest

from autopilot.interface.vehicle_state import Mode
from policies.companion.aftermath import CATCH_HEARD_US, CATCH_LEAST_M, PROVEN_US, STEADY_US, Aftermath, Condition
from policies.companion.engagement import (
    HAND_BACK_PATIENCE_US,
    RETURN_PATIENCE_US,
    Engagement,
    Phase,
    Sending,
    Situation,
    Wish,
)

STEP_US = 20_000
RETURN_S, RESUME_S = 60.0, 30.0
FALLING = {"mode": Mode.LAND, "is_failsafe": True}
UNPLACED = {"is_unplaced": True, "trouble": "no attitude or position from the vehicle"}
LOST = {"is_lost": True, "is_alone": True, "trouble": "owner lost"}


class Bench:
    """Steps a state machine through what the vehicle and the owner do, 20 ms apart; keeps what it says and wishes."""

    def __init__(self, return_s=RETURN_S, resume_s=RESUME_S):
        self.machine = Engagement(aftermath=Aftermath(return_s, resume_s))
        self.time_us, self.mode = 0, Mode.HOLD
        self.texts, self.wishes, self.sent = [], [], []

    def step(self, seconds=0.02, *, trouble="", mode=None, is_refused=False, **condition):
        self.mode = self.mode if mode is None else mode
        condition = {"height_m": 1.6, "pos_ned": (0.0, 0.0, -1.6)} | condition
        for _ in range(round(seconds * 1e6) // STEP_US):
            self.time_us += STEP_US
            orders = self.machine.step(
                Situation(
                    self.time_us,
                    is_offboard=self.mode is Mode.OFFBOARD,
                    is_airborne=self.mode is not Mode.LAND and not condition.get("is_down", False),
                    is_holding=self.mode is Mode.HOLD,
                    mode_name=self.mode.name.capitalize(),
                    trouble=trouble,
                    is_refused=is_refused,
                    condition=Condition(mode=self.mode, **condition),
                )
            )
            self.texts += [orders.text] if orders.text else []
            self.wishes += [orders.wish] if orders.wish is not Wish.NONE else []
            self.sent.append(orders.sending)
        return self

    @property
    def phase(self):
        return self.machine.phase

    def flying(self):
        self.step(mode=Mode.HOLD).step(mode=Mode.OFFBOARD)
        assert self.phase is Phase.FLYING
        return self

    def left_alone(self):
        """In Hold, since the owner was lost."""
        self.flying().step(**LOST).step(mode=Mode.HOLD, **LOST)
        assert self.wishes == [Wish.HOLD]
        self.wishes.clear()
        return self

    def falling(self, **condition):
        """The failsafe lands it, and there is no position."""
        self.flying().step(**FALLING, **condition).step(0.6, **FALLING, **UNPLACED | condition)
        assert self.phase in (Phase.RELEASED, Phase.WAITING)
        return self

    def caught(self):
        """In Hold again, with a position."""
        self.falling().step(0.5, **FALLING)
        assert self.wishes[0] is Wish.HOLD
        self.wishes.clear()
        return self.step(mode=Mode.HOLD)


def test_alone_for_long_it_goes_home_and_says_so():
    bench = Bench().left_alone().step(RETURN_S - 1.0, **LOST)
    assert bench.wishes == []
    bench.step(1.1, **LOST)
    assert (bench.wishes, bench.phase) == ([Wish.RETURN], Phase.RETURNING)
    assert bench.texts[-1] == "Companion: owner lost, returning"
    bench.step(5.0, mode=Mode.RETURN, **LOST)
    assert bench.wishes == [Wish.RETURN]
    assert bench.phase is Phase.WAITING


def test_return_that_does_not_come_is_asked_for_again_and_then_given_up():
    bench = Bench().left_alone().step(RETURN_S + RETURN_PATIENCE_US * 1e-6 + 0.5, **LOST)
    assert set(bench.wishes) == {Wish.RETURN}
    assert len(bench.wishes) > 3
    assert "Return was refused" in bench.texts[-1]
    count = len(bench.wishes)
    bench.step(2.0 * RETURN_S, **LOST)
    assert len(bench.wishes) == count


def test_a_return_that_is_refused_is_not_asked_for_again():
    bench = Bench().left_alone().step(RETURN_S + 0.1, **LOST).step(is_refused=True, **LOST).step(RETURN_S, **LOST)
    assert bench.wishes == [Wish.RETURN]


def test_never_means_never():
    assert Bench(return_s=0.0).left_alone().step(1000.0, **LOST).wishes == []


def test_an_owner_who_is_seen_meanwhile_begins_the_wait_anew():
    bench = Bench().left_alone().step(RETURN_S - 1.0, **LOST).step(1.0).step(RETURN_S - 1.0, **LOST)
    assert bench.wishes == []
    assert bench.step(1.1, **LOST).wishes == [Wish.RETURN]


def test_nobody_is_sent_home_without_gnss():
    bench = Bench().left_alone().step(3.0 * RETURN_S, is_by_sight=True, **LOST)
    assert bench.wishes == []
    assert bench.step(RETURN_S - 1.0, **LOST).wishes == []  # from when GNSS is back
    assert bench.step(1.1, **LOST).wishes == [Wish.RETURN]


def test_a_phone_that_is_heard_is_not_an_owner_who_is_seen():
    assert Bench().left_alone().step(RETURN_S + 0.1, is_alone=True).wishes == [Wish.RETURN]  # without trouble: ready


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.LAND, Mode.RETURN, Mode.MISSION, Mode.BRAKE])
def test_whoever_chooses_a_mode_meanwhile_has_the_vehicle(mode):
    bench = Bench().left_alone().step(10.0, **LOST).step(1.0, mode=mode, **LOST)
    assert bench.step(2.0 * RETURN_S, mode=Mode.HOLD, **LOST).wishes == []


def test_whoever_takes_over_while_return_is_asked_for_has_the_vehicle():
    bench = Bench().left_alone().step(RETURN_S + 0.1, **LOST).step(2.0 * RETURN_S, mode=Mode.POSITION, **LOST)
    assert bench.wishes == [Wish.RETURN]
    assert "Companion: stopped: mode Position" in bench.texts


def test_whoever_sends_it_elsewhere_in_hold_has_the_vehicle():
    bench = Bench().left_alone().step(10.0, **LOST).step(10.0, pos_ned=(8.0, 0.0, -1.6), **LOST)
    assert bench.step(2.0 * RETURN_S, **LOST).wishes == []


@pytest.mark.parametrize("end", [{"is_down": True}, {"is_heard": False}])
def test_on_the_ground_or_out_of_touch_nothing_is_left(end):
    bench = Bench().left_alone().step(10.0, **LOST).step(1.0, **LOST, **end)
    assert bench.step(2.0 * RETURN_S, **LOST).wishes == []


def test_under_a_crown_it_stays_and_says_so():
    bench = Bench().left_alone().step(2.0 * RETURN_S, is_covered=True, **LOST)
    assert bench.wishes == []
    assert bench.texts[-1] == "Companion: owner lost, no way up: stays"


def test_a_pilot_who_chose_hold_is_not_sent_home():
    bench = Bench().flying().step(mode=Mode.HOLD)
    assert bench.step(2.0 * RETURN_S, is_alone=True).wishes == []


def test_hold_for_another_reason_is_held():
    bench = Bench().flying().step(trouble="no new pictures", is_alone=True).step(mode=Mode.HOLD)
    bench.wishes.clear()
    assert bench.step(2.0 * RETURN_S, is_alone=True, trouble="no new pictures").wishes == []


def test_a_position_that_is_back_stops_the_descent_and_then_it_follows_again():
    bench = Bench().falling()
    assert bench.wishes == []
    bench.step(0.5, **FALLING)
    assert (bench.wishes, bench.phase, bench.texts[-1]) == (
        [Wish.HOLD],
        Phase.REGAINING,
        "Companion: position is back: hold",
    )
    bench.step(STEADY_US * 1e-6 - 1.0, mode=Mode.HOLD)
    assert bench.wishes == [Wish.HOLD]
    bench.step(0.7)
    assert bench.wishes == [Wish.HOLD, Wish.OFFBOARD]
    bench.step(mode=Mode.OFFBOARD)
    assert (bench.phase, bench.sent[-1]) == (Phase.FLYING, Sending.POLICY)


def test_a_failsafe_that_comes_before_the_position_is_missed_is_known_by_what_follows():
    bench = Bench().flying().step(0.5, **FALLING).step(0.1, **FALLING, **UNPLACED).step(0.5, **FALLING)
    assert bench.wishes[:1] == [Wish.HOLD]


def test_a_position_missed_first_is_handed_back_and_then_regained():
    bench = Bench().flying().step(0.3, **UNPLACED).step(0.5, **FALLING, **UNPLACED)
    bench.wishes.clear()
    assert bench.step(0.5, **FALLING).wishes == [Wish.HOLD]


def test_a_position_that_is_back_while_it_holds_is_enough():
    bench = Bench().flying().step(**UNPLACED).step(0.5, mode=Mode.HOLD, **UNPLACED)
    bench.wishes.clear()
    assert bench.step(STEADY_US * 1e-6 + 0.2).wishes == [Wish.OFFBOARD]


def test_hold_that_becomes_a_failsafe_landing_is_regained_too():
    bench = Bench().flying().step(**UNPLACED).step(0.5, mode=Mode.HOLD, **UNPLACED).step(0.5, **FALLING, **UNPLACED)
    bench.wishes.clear()
    assert bench.step(0.5, **FALLING).wishes == [Wish.HOLD]


def test_a_landing_with_a_position_is_somebody_elses_affair():
    bench = Bench().flying().step(PROVEN_US * 1e-6 + 0.1, **FALLING)
    bench.step(1.0, **FALLING, **UNPLACED)  # lost later: it was not why
    assert bench.step(5.0, **FALLING).wishes == []


def test_a_landing_that_a_pilot_chose_is_left_alone():
    bench = Bench().flying().step(mode=Mode.LAND).step(1.0, **UNPLACED)
    assert bench.step(5.0).wishes == []
    bench = Bench().falling().step(0.2, **UNPLACED)  # in Land still, and no failsafe any more
    assert bench.step(5.0).wishes == []


@pytest.mark.parametrize("mode", [Mode.POSITION, Mode.ALTITUDE, Mode.HOLD, Mode.RETURN])
@pytest.mark.parametrize("is_lost_again", [False, True])
def test_a_pilot_who_takes_it_out_of_the_landing_has_it(mode, is_lost_again):
    bench = Bench().falling()
    if is_lost_again:  # when Hold was asked for, and has not come
        bench.step(0.5, **FALLING).step(0.2, **FALLING, **UNPLACED)
        assert set(bench.wishes) == {Wish.HOLD}
        bench.wishes.clear()
    bench.step(0.2, mode=mode, **UNPLACED)
    assert not bench.machine.has_chosen
    assert bench.step(10.0, **{"mode": mode} if mode is Mode.HOLD else FALLING).wishes == []


STALE = {"heartbeat_age_us": 400_000}  # since it told its mode


def test_home_is_asked_for_only_on_a_mode_that_was_just_heard():
    bench = Bench().left_alone().step(RETURN_S + 1.0, **LOST, **STALE)
    assert bench.wishes == []
    bench.step(**LOST).step(2.0, **LOST, **STALE)
    assert bench.wishes == [Wish.RETURN]
    assert bench.step(**LOST).wishes == [Wish.RETURN, Wish.RETURN]


def test_offboard_is_asked_for_only_on_a_mode_that_was_just_heard():
    bench = Bench().caught().step(STEADY_US * 1e-6 + 1.0, **STALE)
    assert bench.wishes == []
    bench.step().step(2.0, **STALE)
    assert (bench.wishes, bench.phase) == ([Wish.OFFBOARD], Phase.ENGAGING)
    assert bench.step().wishes == [Wish.OFFBOARD, Wish.OFFBOARD]


def test_the_descent_is_stopped_between_two_heartbeats_but_after_none_that_is_missed():
    assert Bench().falling().step(5.0, **FALLING, heartbeat_age_us=CATCH_HEARD_US + 1).wishes == []
    bench = Bench().falling().step(2.0, **FALLING, heartbeat_age_us=CATCH_HEARD_US)
    assert bench.wishes == [Wish.HOLD]
    assert bench.step(**FALLING).wishes == [Wish.HOLD, Wish.HOLD]


def test_a_hold_of_the_failsafe_is_no_pilots():
    bench = Bench().falling().step(0.2, mode=Mode.HOLD, is_failsafe=True)
    assert bench.step(STEADY_US * 1e-6 + 0.1).wishes == [Wish.OFFBOARD]


def test_a_pilot_who_takes_over_while_it_waits_in_hold_has_it():
    bench = Bench().caught().step(1.0).step(0.1, mode=Mode.POSITION)
    assert "Companion: stopped: mode Position" in bench.texts
    assert bench.step(20.0, mode=Mode.HOLD).wishes == []


def test_a_pilot_who_takes_over_while_offboard_is_asked_for_has_it():
    bench = Bench().caught().step(STEADY_US * 1e-6 - 0.3)
    assert bench.phase is Phase.ENGAGING
    assert bench.step(20.0, mode=Mode.POSITION).wishes == [Wish.OFFBOARD]


@pytest.mark.parametrize(
    "condition",
    [{"is_well": False}, {"height_m": CATCH_LEAST_M - 0.1}, {"height_m": float("nan")}, {"is_heard": False}],
)
def test_it_is_not_taken_out_of_the_landing(condition):
    assert Bench().falling().step(5.0, **FALLING, **condition).wishes == []


def test_on_the_ground_it_stays_down_and_says_so():
    bench = Bench().falling().step(**FALLING, is_down=True)
    assert bench.texts[-1] == "Companion: landed by failsafe: stays down"
    assert bench.step(20.0, mode=Mode.HOLD).wishes == []


def test_hold_that_is_not_taken_leaves_it_to_the_landing():
    bench = Bench().falling().step(HAND_BACK_PATIENCE_US * 1e-6 + 0.6, **FALLING)
    assert set(bench.wishes) == {Wish.HOLD}
    assert bench.texts[-1] == "Companion: Hold was not taken"
    bench.wishes.clear()
    assert bench.step(10.0, **FALLING).wishes == []


def test_a_position_lost_again_lands_again_and_may_be_regained_again():
    bench = Bench().caught().step(1.0).step(0.6, **UNPLACED).step(1.0, **FALLING, **UNPLACED)
    assert bench.wishes == []
    assert bench.step(0.5, **FALLING).wishes == [Wish.HOLD]


def test_another_failsafe_that_lands_meanwhile_is_obeyed():
    assert Bench().caught().step(1.0).step(10.0, **FALLING).wishes == []


def test_offboard_that_is_refused_is_not_asked_for_again():
    bench = Bench().caught().step(STEADY_US * 1e-6 - 0.3).step(is_refused=True)
    assert "not engaged" in bench.texts[-1]
    assert bench.step(20.0).wishes == [Wish.OFFBOARD]


@pytest.mark.parametrize("missing", [{"is_alone": True}, {"is_well": False}, {"trouble": "no new pictures"}])
def test_it_goes_on_only_with_all_that_it_needs_and_in_time(missing):
    bench = Bench().caught().step(RESUME_S, **missing)
    assert bench.wishes == []
    assert bench.texts[-1].startswith("Companion: stays in hold: ")
    assert bench.step(20.0).wishes == []  # too late


def test_an_owner_who_was_not_found_again_by_then_is_not_waited_for_for_ever():
    bench = Bench().caught().step(RETURN_S + 0.1, is_alone=True)
    assert bench.wishes == [Wish.RETURN]


def test_without_a_time_for_it_it_lands():
    assert Bench(resume_s=0.0).falling().step(5.0, **FALLING).wishes == []


@pytest.mark.parametrize(("resume_s", "condition"), [(0.0, {}), (RESUME_S, {"is_well": False}), (3.0, {})])
def test_a_landing_that_is_not_to_end_is_sent_nothing(resume_s, condition):
    bench = Bench(resume_s=resume_s).falling().step(3.0, **FALLING, **UNPLACED)
    bench.sent.clear()
    bench.step(5.0, **FALLING, **condition)
    assert bench.phase is Phase.READY
    assert set(bench.sent) == {Sending.NOTHING}
    assert bench.step(mode=Mode.HOLD).sent[-1] is Sending.STAY


def test_a_landing_that_it_may_end_is_sent_setpoints_that_stay():
    assert Bench().falling().step(1.0, **FALLING).sent[-1] is Sending.STAY


def test_the_modes_that_it_brought_about_are_its_own_until_they_change():
    bench = Bench().left_alone()
    assert bench.machine.has_chosen
    bench.step(RETURN_S + 0.1, **LOST).step(5.0, mode=Mode.RETURN, **LOST)
    assert (bench.phase, bench.machine.has_chosen) == (Phase.WAITING, True)
    assert not bench.step(mode=Mode.HOLD, **LOST).machine.has_chosen
    assert not bench.step(mode=Mode.RETURN, **LOST).machine.has_chosen


def test_hold_in_which_it_stays_is_still_its_own():
    bench = Bench().left_alone().step(2.0 * RETURN_S, is_covered=True, **LOST)
    assert bench.machine.has_chosen


def test_a_pilots_hold_is_not_its_own():
    assert not Bench().flying().step(mode=Mode.HOLD).machine.has_chosen


def test_an_autopilot_that_goes_back_to_offboard_by_itself_is_flown():
    bench = Bench().falling().step(0.1, **FALLING).step(mode=Mode.OFFBOARD)
    assert bench.phase is Phase.FLYING
