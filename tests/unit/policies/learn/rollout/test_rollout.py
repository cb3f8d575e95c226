"""A rollout of numbers that can be traced: what is seen is 1000 x environment + decision, so anything shifted shows."""

import pytest
import torch

from policies.learn.networks.action_distributions import Actions
from policies.learn.networks.observations import Observation
from policies.learn.rollout.rollout import Rollout
from policies.tasks.layout import Branch, Element, ImageElement, Layout

STEPS, ENVS, LENGTH = 12, 5, 4
LAYOUT = Layout(
    "Traced",
    1,
    frame=(Element("trace", "1"), Element("twice", "1")),
    continuous=(Element("push", "1"),),
    branches=(Branch("gear", ("a", "b")),),
    image=ImageElement(2, 3, ("decision", "environment", "is_last")),
    privileged=(Element("minus_trace", "1"),),
)
ENDS = [(3, 0), (0, 1), (11, 2), (5, 3), (6, 3)]  # (decision, environment)


class TracedTask:
    """What a task shows after each decision, without a task."""

    def __init__(self):
        self.decision = 0
        self.traces = 1000.0 * torch.arange(ENVS, dtype=torch.float32)

    def step(self):
        here = [(decision, env) in ENDS for env in range(ENVS) for decision in [self.decision]]
        self.is_truncated = torch.tensor(here) & (torch.arange(ENVS) == 3)
        self.is_terminated = torch.tensor(here) & ~self.is_truncated
        self.decision += 1
        self.rewards = self.traces + self.decision
        self.final_observation = self.traced(0.5)

    def traced(self, more=0.0):
        """Floats of 1000 x environment + decision; images of decision, environment, and whether it was the last."""
        trace = self.traces + self.decision + more
        image = torch.tensor([[self.decision, env, 1 if more else 0] for env in range(ENVS)], dtype=torch.uint8)
        image = image[:, None, None].expand(-1, 2, 3, -1)
        return Observation(torch.stack((trace, 2.0 * trace), -1), image, -trace[:, None])

    @property
    def observation(self):
        return self.traced()


@pytest.fixture(params=[0, 6], ids=["feed-forward", "recurrent"])
def rollout(request):
    memory = (request.param, LENGTH if request.param else 1)
    made = Rollout(LAYOUT, (STEPS, ENVS), 1, memory, torch.device("cpu"))
    task = TracedTask()
    made.begin(task)
    for t in range(STEPS):
        trace = made.observations[t, :, :1]
        if t % made.sequence_length == 0:
            made.memories[t // made.sequence_length] = trace
            made.critic_memories[t // made.sequence_length] = trace + 0.25
        task.step()
        made.record(t, Actions(trace, trace.long() % 2), -trace.expand(-1, 2), task)
    made.values.copy_(made.observations[:-1, :, :1])
    made.returns.copy_(made.observations[:-1, :, :1])
    made.advantages.copy_(made.observations[:-1, :, 0])
    return made


def traces(steps=STEPS):
    return 1000.0 * torch.arange(ENVS)[None] + torch.arange(steps)[:, None]


def test_nothing_is_shifted(rollout):
    assert torch.equal(rollout.observations[..., 0], traces(STEPS + 1))
    assert torch.equal(rollout.rewards, traces() + 1.0)
    assert [tuple(end) for end in rollout.is_over.nonzero().tolist()] == sorted(ENDS)
    assert [tuple(end) for end in rollout.is_truncated.nonzero().tolist()] == [(5, 3), (6, 3)]


def test_next_observations_are_what_ended_episodes_saw_last(rollout):
    expected = traces() + 1.0
    for decision, env in ENDS:
        expected[decision, env] += 0.5
    assert torch.equal(rollout.next_observations()[..., 0], expected)


def test_images_and_privileged_elements_are_those_of_the_floats(rollout):
    image = rollout.observation.image.long()
    assert torch.equal(1000 * image[:, :, 1, 2, 1] + image[:, :, 0, 0, 0], rollout.observations[..., 0].long())
    assert not image[..., 2].any()
    assert torch.equal(rollout.observation.privileged[..., 0], -rollout.observations[..., 0])
    for t in range(STEPS):
        following = rollout.next_observation(t)
        assert torch.equal(following.vector, rollout.next_observations()[t])
        assert torch.equal(following.privileged[:, 0], -following.vector[:, 0])
        assert following.image[:, 0, 0, 1].tolist() == list(range(ENVS))
        assert following.image[:, 1, 1, 0].tolist() == [t + 1] * ENVS
        assert torch.equal(following.image[:, 0, 0, 2].bool(), rollout.is_over[t])
    last = rollout.last_seen()
    assert last.image[:, 0, 0, :2].tolist() == [[decision + 1, env] for decision, env in sorted(ENDS)]
    assert torch.equal(last.vector[:, 0], -last.privileged[:, 0])
    assert (last.vector[:, 0] % 1 == 0.5).all()


def test_transitions_carry_the_actions_the_task_took(rollout):
    transitions = rollout.transitions()
    assert torch.equal(transitions.continuous[..., 0], traces().clamp(max=3.0) / 3.0)
    assert torch.equal(transitions.branches[..., 0], traces().long() % 2)
    assert torch.equal(transitions.is_ended, rollout.is_over)


def test_a_minibatch_keeps_what_belongs_together(rollout):
    for batch in rollout.minibatches(8, torch.Generator().manual_seed(0)):
        trace = batch.observations[:, 0]
        assert torch.equal(traces().flatten()[batch.rows], trace)
        assert torch.equal(batch.observations[:, 1], 2.0 * trace)
        assert torch.equal(batch.observation.privileged[:, 0], -trace)
        assert torch.equal(batch.observation.image[:, 1, 1, 0], (trace % 1000).byte())
        assert torch.equal(batch.observation.image[:, 0, 2, 1], (trace // 1000).byte())
        assert torch.equal(batch.actions.continuous[:, 0], trace)
        assert torch.equal(batch.actions.branches[:, 0], trace.long() % 2)
        assert torch.equal(batch.log_probs, -trace[:, None].expand(-1, 2))
        for column in (batch.values[:, 0], batch.returns[:, 0], batch.advantages):
            assert torch.equal(column, trace)


def test_an_epoch_draws_every_decision_once(rollout):
    batches = list(rollout.minibatches(12, torch.Generator().manual_seed(0)))
    assert sorted(torch.cat([batch.rows for batch in batches]).tolist()) == list(range(STEPS * ENVS))


def test_minibatches_are_whole_and_what_is_left_over_is_dropped(rollout):
    batches = list(rollout.minibatches(16, torch.Generator().manual_seed(0)))
    assert [len(batch.rows) for batch in batches] == [16, 16, 16]
    assert len(next(rollout.minibatches(10_000, torch.Generator().manual_seed(0))).rows) == STEPS * ENVS


@pytest.mark.parametrize("rollout", [6], indirect=True)
def test_sequences_are_consecutive_decisions_of_one_environment_with_their_memory(rollout):
    over = rollout.is_over
    for batch in rollout.minibatches(8, torch.Generator().manual_seed(0)):
        trace = batch.observations[:, 0].view(LENGTH, -1)
        assert torch.equal(trace, trace[0] + torch.arange(LENGTH)[:, None])
        assert (trace[0] % 1000 % LENGTH == 0).all()
        assert torch.equal(batch.sequences.memory, trace[0][:, None].expand(-1, 6))
        assert torch.equal(batch.sequences.critic_memory, trace[0][:, None].expand(-1, 6) + 0.25)
        for k in range(trace.shape[1]):
            env, first = int(trace[0, k]) // 1000, int(trace[0, k]) % 1000
            starts = [first + i > 0 and bool(over[first + i - 1, env]) for i in range(LENGTH)]
            assert batch.sequences.is_start[:, k].tolist() == starts
