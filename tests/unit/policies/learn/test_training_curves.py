"""Training curves: TensorBoard reads them, and a resumed run shows no step twice."""

import pytest
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

from policies.learn.training_curves import NO_SCORES, EventFile, Period
from policies.tasks.episode import Outcome
from policies.tasks.task import Scores


def points(folder):
    (path,) = folder.glob("*tfevents*")
    events = list(EventFileLoader(str(path)).Load())
    return [(event.step, value.tag, value.tensor.float_val[0]) for event in events for value in event.summary.value]


def scores(success, fell, total, length):
    outcomes = [0] * len(Outcome)
    outcomes[Outcome.SUCCESS], outcomes[Outcome.FELL] = success, fell
    return Scores(tuple(outcomes), total, length)


def test_tensorboard_reads_the_curves(tmp_path):
    file = EventFile(tmp_path)
    file.write(10, {"Losses/Policy Loss": 0.5})
    file.write(20, {"Losses/Policy Loss": 0.25, "Policy/Entropy": 1.0})
    file.close()
    assert points(tmp_path) == [
        (10, "Losses/Policy Loss", 0.5),
        (20, "Losses/Policy Loss", 0.25),
        (20, "Policy/Entropy", 1.0),
    ]


def test_resumed_run_shows_no_step_twice(tmp_path):
    file = EventFile(tmp_path)
    file.write(10, {"a": 1.0})
    position = file.position()
    file.write(20, {"a": 2.0})
    file.write(30, {"a": 3.0})
    file.close()
    again = EventFile(tmp_path, position)
    again.write(20, {"a": 4.0})
    again.close()
    assert points(tmp_path) == [(10, "a", 1.0), (20, "a", 4.0)]


def test_resumed_run_whose_curves_were_deleted_begins_new_ones(tmp_path):
    file = EventFile(tmp_path, {"file": "events.out.tfevents.1.honeyguide", "bytes": 1000})
    file.write(20, {"a": 4.0})
    file.close()
    assert points(tmp_path) == [(20, "a", 4.0)]


def test_period_takes_means_over_iterations_and_over_episodes():
    period = Period()
    period.add(scores(3, 1, 2.0, 40.0), {"Losses/Value Loss": 1.0})
    period.add(scores(0, 1, -1.0, 20.0), {"Losses/Value Loss": 2.0, "Policy/Beta": 0.1})
    assert period.values() == {
        "Losses/Value Loss": 1.5,
        "Policy/Beta": 0.1,
        "Environment/Cumulative Reward": pytest.approx(0.2),
        "Environment/Episode Length": 12.0,
        "Environment/Success Rate": pytest.approx(0.6),
    }


def test_period_without_an_ended_episode_has_no_episode_curves():
    period = Period()
    period.add(NO_SCORES, {"Losses/Value Loss": 1.0})
    assert list(period.values()) == ["Losses/Value Loss"]


def test_restored_period_goes_on():
    period, restored = Period(), Period()
    period.add(scores(3, 1, 2.0, 40.0), {"Losses/Value Loss": 1.0})
    restored.load_state(period.state())
    for each in (period, restored):
        each.add(scores(0, 1, -1.0, 20.0), {"Losses/Value Loss": 2.0})
    assert period.values() == restored.values()
