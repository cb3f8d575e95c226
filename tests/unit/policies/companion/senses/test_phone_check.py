"""What the phone says of whom is taken for the owner."""

import numpy as np

from policies.companion.senses.phone_check import PhoneCheck, Word

HERE, AWAY = np.array([2.0, 0.0, -1.0]), np.array([-3.0, 4.0, -1.0])
OFF = np.array([1.5, -1.0, 0.0])  # the phone's slow error


def learned() -> PhoneCheck:
    check = PhoneCheck()
    for _ in range(20):
        assert check.hear(HERE + OFF, HERE, [AWAY], has_met_others=True)[0] is Word.AGREES
    return check


def words(check: PhoneCheck, phone: np.ndarray, seen: np.ndarray, others: list, times: int, *, met: bool) -> list[Word]:
    return [check.hear(phone, seen, others, has_met_others=met)[0] for _ in range(times)]


def test_who_fits_the_phone_better_for_some_reports_is_the_owner() -> None:
    assert words(learned(), HERE + OFF, AWAY, [HERE], 3, met=True) == [Word.AGREES, Word.AGREES, Word.ANOTHER]


def test_who_is_far_from_the_phone_where_others_were_is_not_the_owner() -> None:
    assert words(learned(), HERE + OFF, AWAY, [], 3, met=True)[-1] is Word.NOBODY


def test_a_phone_alone_makes_nobody_doubt() -> None:
    assert set(words(learned(), HERE + OFF, AWAY, [], 10, met=False)) == {Word.AGREES}


def test_its_slow_error_is_learned() -> None:
    owner = learned().owner(HERE + OFF)
    assert owner is not None
    assert np.hypot(*(owner - HERE[:2])) < 1e-6
