"""Curricula: lessons end when their criteria are met, as in ML-Agents, and not before."""

import pytest
from pydantic import TypeAdapter, ValidationError

from policies.learn.config.environment import EnvironmentParameter
from policies.learn.curriculum import Curriculum, RecentEpisodes
from policies.learn.training_curves import NO_SCORES
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores
from policies.tasks.task_params import Sampler


def scores(count, mean_return, successes=0):
    outcomes = [0] * len(Outcome)
    outcomes[Outcome.SUCCESS], outcomes[Outcome.FELL] = successes, count - successes
    return Scores(tuple(outcomes), mean_return * count, 10.0 * count)


def parameters(**raw):
    return {name: TypeAdapter(EnvironmentParameter).validate_python(value) for name, value in raw.items()}


def lessons(measure, threshold, **more):
    criteria = {"behavior": "B", "measure": measure, "threshold": threshold, **more}
    uniform = {"sampler_type": "uniform", "sampler_parameters": {"min_value": 2.0, "max_value": 3.0}}
    return {
        "curriculum": [
            {"name": "near", "value": 1.0, "completion_criteria": criteria},
            {"name": "far", "value": uniform},
        ]
    }


def test_numbers_and_samplers_are_single_lessons():
    gaussian = {"sampler_type": "gaussian", "sampler_parameters": {"mean": 1.0, "st_dev": 0.5}}
    curriculum = Curriculum(parameters(a=2.0, b=gaussian))
    assert curriculum.params() == {"a": Sampler.constant(2.0), "b": Sampler(mean=1.0, st_dev=0.5)}
    assert curriculum.is_last
    assert curriculum.advance(scores(10, 1.0), 1.0) == ([], False)


def test_lesson_ends_when_enough_of_the_training_is_done():
    curriculum = Curriculum(parameters(a=lessons("progress", 0.5)))
    assert curriculum.advance(NO_SCORES, 0.5) == ([], False)
    assert curriculum.advance(NO_SCORES, 0.51) == (["a: lesson far begins"], False)
    assert curriculum.params() == {"a": Sampler(intervals=((2.0, 3.0),))} == curriculum.final_params()
    assert curriculum.tags() == {"Environment/Lesson Number/a": 1.0}


def test_lesson_ends_when_the_mean_reward_is_above_the_threshold():
    curriculum = Curriculum(parameters(a=lessons("reward", 1.0, signal_smoothing=False)))
    curriculum.advance(scores(5, 1.0), 0.0)
    assert curriculum.lesson == {"a": 0}
    curriculum.advance(scores(5, 1.1), 0.0)
    assert curriculum.lesson == {"a": 1}


def test_lesson_does_not_end_before_its_least_length():
    curriculum = Curriculum(parameters(a=lessons("reward", 1.0, signal_smoothing=False, min_lesson_length=20)))
    curriculum.advance(scores(19, 5.0), 0.0)
    assert not curriculum.is_last
    curriculum.advance(scores(1, 5.0), 0.0)
    assert curriculum.is_last


def test_smoothed_reward_is_three_quarters_new():
    curriculum = Curriculum(parameters(a=lessons("reward", 0.9)))
    curriculum.advance(scores(5, 1.0), 0.0)  # 0.75
    assert curriculum.lesson == {"a": 0}
    curriculum.advance(scores(5, 1.0), 0.0)  # 0.25 * 0.75 + 0.75
    assert curriculum.lesson == {"a": 1}


def test_lesson_ends_by_success():
    curriculum = Curriculum(parameters(a=lessons("success", 0.8, signal_smoothing=False, require_reset=True)))
    assert curriculum.advance(scores(10, 9.0, successes=8), 0.0) == ([], False)
    assert curriculum.advance(scores(10, 9.0, successes=9), 0.0) == (["a: lesson far begins"], True)


def test_success_is_a_share():
    with pytest.raises(ValidationError, match="threshold 80 of success is not between 0 and 1"):
        parameters(a=lessons("success", 80.0))


def test_episodes_of_the_lesson_before_do_not_count():
    three = lessons("reward", 0.5, signal_smoothing=False, min_lesson_length=10)
    middle = {**three["curriculum"][0], "name": "middle", "value": 1.5}
    three["curriculum"].insert(1, middle)
    curriculum = Curriculum(parameters(a=three))
    curriculum.advance(scores(10, 1.0), 0.0)
    curriculum.advance(scores(9, 1.0), 0.0)
    assert curriculum.lesson == {"a": 1}
    curriculum.advance(scores(1, 1.0), 0.0)
    assert curriculum.lesson == {"a": 2}


def test_restored_curriculum_goes_on():
    settings = parameters(a=lessons("reward", 0.9), b=lessons("progress", 0.2))
    curriculum, restored = Curriculum(settings), Curriculum(settings)
    curriculum.advance(scores(5, 1.0), 0.3)
    restored.load_state(curriculum.state())
    assert restored.lesson == {"a": 0, "b": 1}
    assert curriculum.advance(scores(5, 1.0), 0.4) == restored.advance(scores(5, 1.0), 0.4)
    assert restored.is_last


def test_recent_episodes_are_at_least_so_many_and_the_newest():
    recent = RecentEpisodes(10)
    for k in range(20):
        recent.add(scores(4, float(k)))
    assert recent.scores.episode_count == 12
    assert recent.scores.return_sum == 4 * (17 + 18 + 19)
