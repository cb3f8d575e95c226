"""The ring of stretches: what is drawn is what was recorded, in order; the oldest round goes first."""

import torch

from policies.learn.networks.action_distributions import Actions
from policies.learn.networks.observations import Observation
from policies.learn.rollout.sequence_buffer import SequenceRing
from tests.unit.policies.learn.algorithms.test_sac import flat
from tests.unit.policies.learn.glimpses import SIDE, Glimpses

ENVS, LENGTH = 3, 4


def ring(capacity=24):
    return SequenceRing(Glimpses(1).layout, capacity, ENVS, length=LENGTH, memory_size=2, device=torch.device("cpu"))


def fill(store, rounds, first=0):
    """Each number says where it belongs: 100 x round + 10 x decision + environment."""
    env = torch.arange(ENVS)
    for r in range(first, first + rounds):
        slot = store.open((100.0 * r + env)[:, None].expand(ENVS, 2))
        for t in range(LENGTH):
            code = (100 * r + 10 * t + env)[:, None].float()
            image = (10 * t + env).to(torch.uint8)[:, None, None, None].expand(ENVS, SIDE, SIDE, 3)
            observation = Observation(code, image, code.expand(ENVS, 2))
            actions = Actions(code / 1000.0, torch.zeros(ENVS, 0, dtype=torch.int64))
            store.record(slot, t, observation, actions, env == t)


def test_stretches_are_consecutive_and_whole():
    store = ring()
    fill(store, 2)
    drawn = store.draw(40, torch.Generator().manual_seed(0))
    codes = drawn.observation.vector[..., 0]
    assert (codes.diff(dim=0) == 10.0).all()
    assert torch.equal(drawn.observation.image[..., 0, 0, 0].float(), codes % 100)
    assert torch.equal(drawn.observation.privileged[..., 1], codes)
    assert torch.allclose(drawn.actions.continuous[..., 0], codes / 1000.0)
    assert torch.equal(drawn.memory[:, 0], codes[0])
    env = codes[0] % 10
    assert torch.equal(drawn.is_start, torch.arange(LENGTH)[:, None] == env)
    assert len(codes[0].unique()) == 2 * ENVS


def test_the_oldest_round_is_written_over():
    store = ring(capacity=24)
    fill(store, 3)
    assert len(store) == 2 * ENVS
    drawn = store.draw(60, torch.Generator().manual_seed(0)).observation.vector[0, :, 0]
    assert set((drawn // 100).tolist()) == {1.0, 2.0}


def test_restored_ring_draws_the_same():
    store = ring()
    fill(store, 1)
    other = ring()
    other.load_state(store.state())
    a, b = (each.draw(9, torch.Generator().manual_seed(3)) for each in (store, other))
    assert torch.equal(a.observation.vector, b.observation.vector)
    fill(store, 2, first=1)
    fill(other, 2, first=1)
    assert flat(store.state()) == flat(other.state())
