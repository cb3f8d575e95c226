"""What a guard changes is counted by its reason, and said where a reason begins."""

from policies.companion.guard.interventions import (
    NEAR_SOMEBODY,
    NEAR_SOMETHING,
    NO_DEPTH,
    BeginningReasons,
    Interventions,
)

STEP_US = 100_000


def texts(*spans, seconds=20.0):
    """The texts of a flight by their time [s], given spans of reasons: (reason, from [s], to [s])."""
    begins, found = BeginningReasons(), {}
    for k in range(round(seconds * 10)):
        now_s = 0.1 * k
        latest = [reason for reason, start, end in spans if start <= now_s + 1e-6 < end]
        if text := begins.text(latest, 1_000_000_000 + k * STEP_US):
            found[round(now_s, 1)] = text
    return found


def test_the_reasons_of_the_newest_decision_are_its_own_and_the_counts_the_flights():
    changed = Interventions()
    for _ in range(3):
        changed.decide()
        changed.note(NEAR_SOMEBODY)
        changed.note(NO_DEPTH)
    changed.decide()
    changed.note(NEAR_SOMETHING)
    assert changed.latest == [NEAR_SOMETHING]
    assert changed == {NEAR_SOMEBODY: 3, NO_DEPTH: 3, NEAR_SOMETHING: 1}


def test_a_reason_that_goes_on_or_flickers_is_said_once():
    assert texts((NEAR_SOMEBODY, 2.0, 18.0)) == {2.0: "guard: near somebody"}
    flickers = [(NEAR_SOMEBODY, start, start + 0.3) for start in range(2, 18, 4)]
    assert texts(*flickers) == {2.0: "guard: near somebody"}


def test_a_reason_that_comes_again_after_five_seconds_is_said_again():
    assert list(texts((NO_DEPTH, 1.0, 2.0), (NO_DEPTH, 7.5, 9.0))) == [1.0, 7.5]


def test_of_reasons_that_begin_at_once_the_second_is_said_a_second_later_if_it_is_still_there():
    both = texts((NEAR_SOMEBODY, 3.0, 5.0), (NEAR_SOMETHING, 3.0, 5.0))
    assert both == {3.0: "guard: near somebody", 4.0: "guard: near something"}
    assert list(texts((NEAR_SOMEBODY, 3.0, 5.0), (NEAR_SOMETHING, 3.0, 3.5))) == [3.0]


def test_a_stance_is_no_reason_of_its_own_here():
    assert texts(("searching the owner", 1.0, 9.0)) == {}


def test_a_vehicle_that_has_restarted_begins_anew():
    begins = BeginningReasons()
    assert begins.text([NEAR_SOMEBODY], 100_000_000)
    assert begins.text([NEAR_SOMEBODY], 2_000_000) == "guard: near somebody"
