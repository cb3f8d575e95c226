"""Who flies: one law per change of phase."""

import pytest

from policies.companion.engagement import (
    ASK_AGAIN_US,
    ENGAGE_PATIENCE_US,
    HAND_BACK_PATIENCE_US,
    SILENCE_US,
    Engagement,
    Phase,
    Sending,
    Situation,
    Wish,
)

STEP_US = 20_000


class Bench:
    """Steps a state machine through situations, 20 ms apart."""

    def __init__(self, *, is_reported=False):
        self.machine = Engagement(is_reported=is_reported)
        self.time_us = 0

    def step(self, *, trouble="", offboard=False, airborne=True, holding=True, refused=False, after_us=STEP_US):
        self.time_us += after_us
        situation = Situation(self.time_us, offboard, airborne, holding, "Position", trouble, refused)
        return self.machine.step(situation)

    @property
    def phase(self):
        return self.machine.phase

    def ready(self):
        self.step()
        assert self.phase is Phase.READY
        return self

    def flying(self):
        self.ready().step(offboard=True)
        assert self.phase is Phase.FLYING
        return self

    def handing_back(self):
        self.flying().step(offboard=True, trouble="no pictures")
        assert self.phase is Phase.HANDING_BACK
        return self

    def released(self):
        self.flying().step(offboard=False)
        assert self.phase is Phase.RELEASED
        return self


def test_nothing_is_sent_while_something_is_missing():
    orders = Bench().step(trouble="no pictures")
    assert (orders.sending, orders.wish, orders.text) == (Sending.NOTHING, Wish.NONE, "")


def test_ready_offers_setpoints_that_stay_and_asks_for_no_mode():
    bench = Bench()
    assert "ready" in bench.step().text
    orders = bench.step()
    assert (orders.sending, orders.wish) == (Sending.STAY, Wish.NONE)


def test_ready_ends_when_something_goes_missing():
    orders = Bench().ready().step(trouble="owner lost")
    assert orders.sending is Sending.NOTHING
    assert "owner lost" in orders.text


def test_the_pilot_engages_by_choosing_offboard():
    orders = Bench().ready().step(offboard=True)
    assert orders.sending is Sending.POLICY
    assert orders.wish is Wish.NONE


def test_a_vehicle_found_in_offboard_is_left_to_whoever_flies_it():
    bench = Bench()
    for _ in range(5):
        orders = bench.step(offboard=True)
        assert orders.sending is Sending.NOTHING
    assert bench.phase is Phase.READY
    assert bench.step(offboard=False).sending is Sending.STAY


def test_offboard_chosen_before_everything_was_there_does_not_engage_later():
    bench = Bench()
    bench.step(trouble="no pictures")
    bench.step(trouble="no pictures", offboard=True)
    bench.step(offboard=True)
    bench.step(offboard=True)
    assert bench.phase is Phase.READY


def test_told_to_engage_it_asks_for_offboard_once_airborne_and_again_until_it_comes():
    bench = Bench(is_reported=True).ready()
    assert bench.step(airborne=False).wish is Wish.NONE
    assert bench.step(holding=False).wish is Wish.NONE
    orders = bench.step()
    assert (bench.phase, orders.wish, orders.sending) == (Phase.ENGAGING, Wish.OFFBOARD, Sending.STAY)
    assert bench.step().wish is Wish.NONE
    assert bench.step(after_us=ASK_AGAIN_US).wish is Wish.OFFBOARD
    assert bench.step(offboard=True).sending is Sending.POLICY
    assert bench.phase is Phase.FLYING


@pytest.mark.parametrize("how", [{"refused": True}, {"after_us": ENGAGE_PATIENCE_US + 1}])
def test_a_refused_offboard_is_not_asked_for_again(how):
    bench = Bench(is_reported=True).ready()
    bench.step()
    assert "refused" in bench.step(**how).text
    assert bench.phase is Phase.READY
    assert all(bench.step(after_us=ASK_AGAIN_US).wish is Wish.NONE for _ in range(20))


def test_trouble_while_engaging_ends_it():
    bench = Bench(is_reported=True).ready()
    bench.step()
    assert "no pictures" in bench.step(trouble="no pictures").text
    assert bench.phase is Phase.WAITING


def test_trouble_in_flight_hands_back_by_hold_with_its_reason():
    bench = Bench().flying()
    orders = bench.step(offboard=True, trouble="owner lost")
    assert (orders.sending, orders.wish) == (Sending.STAY, Wish.HOLD)
    assert orders.text == "Companion: hold: owner lost"


def test_hold_is_asked_for_again_until_it_comes_and_then_nothing_is_sent():
    bench = Bench().handing_back()
    assert bench.step(offboard=True).wish is Wish.NONE
    assert bench.step(offboard=True, after_us=ASK_AGAIN_US).wish is Wish.HOLD
    assert bench.step(offboard=False).sending is Sending.NOTHING
    assert bench.phase is Phase.RELEASED


def test_recovered_data_do_not_take_control_back_while_handing_back():
    bench = Bench().handing_back()
    orders = bench.step(offboard=True)
    assert (bench.phase, orders.sending) == (Phase.HANDING_BACK, Sending.STAY)


def test_a_hold_that_is_never_taken_is_left_to_the_vehicle():
    bench = Bench().handing_back()
    orders = bench.step(offboard=True, after_us=HAND_BACK_PATIENCE_US + 1)
    assert (bench.phase, orders.sending) == (Phase.RELEASED, Sending.NOTHING)


def test_any_mode_of_the_pilots_stops_it_at_once():
    bench = Bench().flying()
    orders = bench.step(offboard=False)
    assert (bench.phase, orders.sending, orders.wish) == (Phase.RELEASED, Sending.NOTHING, Wish.NONE)
    assert "Position" in orders.text


def test_landing_stops_it():
    bench = Bench().flying()
    assert bench.step(offboard=True, airborne=False).sending is Sending.NOTHING
    assert bench.phase is Phase.RELEASED


def test_released_it_is_silent_and_flies_again_only_when_offboard_is_chosen_anew():
    bench = Bench(is_reported=False).released()
    assert bench.step(after_us=SILENCE_US - STEP_US).sending is Sending.NOTHING
    for _ in range(500):
        orders = bench.step()
        assert orders.wish is Wish.NONE
        assert orders.sending is not Sending.POLICY
    assert bench.step(offboard=True).sending is Sending.POLICY


@pytest.mark.parametrize("after_us", [STEP_US, SILENCE_US, SILENCE_US + STEP_US])
def test_offboard_chosen_again_soon_is_flown_at_once(after_us):
    bench = Bench().released()
    bench.step(after_us=after_us)
    assert bench.step(offboard=True).sending is Sending.POLICY


def test_offboard_chosen_again_without_pictures_is_not_flown():
    bench = Bench().released()
    bench.step(offboard=True, trouble="no pictures")
    for _ in range(500):
        assert bench.step(offboard=True).sending is Sending.NOTHING


def test_told_once_it_does_not_engage_again_after_the_pilot_took_over():
    bench = Bench(is_reported=True).ready()
    bench.step()
    bench.step(offboard=True)
    bench.step(offboard=False)
    assert all(bench.step().wish is Wish.NONE for _ in range(500))
    bench.machine.engage()
    assert bench.step().wish is Wish.OFFBOARD


def test_offboard_left_on_after_a_failed_hand_back_does_not_engage():
    bench = Bench().handing_back()
    bench.step(offboard=True, trouble="x", after_us=HAND_BACK_PATIENCE_US + 1)
    for _ in range(500):
        assert bench.step(offboard=True).sending is Sending.NOTHING  # the vehicle's own failsafe is to notice


def test_told_to_engage_it_takes_nothing_back_from_a_pilot_who_chose_offboard_himself():
    bench = Bench(is_reported=True)
    bench.step(holding=False)
    bench.step(offboard=True, holding=False)
    assert bench.phase is Phase.FLYING
    bench.step()  # the pilot's Hold
    assert {bench.step().wish for _ in range(500)} == {Wish.NONE}


def test_a_goto_to_one_that_flies_is_no_word_for_later():
    bench = Bench().flying()
    bench.machine.engage()
    bench.step()  # the pilot's Hold
    assert {bench.step().wish for _ in range(500)} == {Wish.NONE}


@pytest.mark.parametrize(("is_hold", "wishes"), [(True, {Wish.NONE, Wish.OFFBOARD}), (False, {Wish.NONE})])
def test_a_goto_while_it_hands_back_counts_unless_a_pilot_takes_over(is_hold, wishes):
    bench = Bench().handing_back()
    bench.machine.engage()
    bench.step(holding=is_hold)
    assert {bench.step().wish for _ in range(500)} == wishes


def test_a_goto_that_comes_with_the_end_of_the_flight_counts():
    bench = Bench().flying()
    bench.machine.engage(is_flown=False)  # the mode has changed since the last step, which that has not seen yet
    assert "stopped" in bench.step().text
    assert {bench.step().wish for _ in range(500)} == {Wish.NONE, Wish.OFFBOARD}
