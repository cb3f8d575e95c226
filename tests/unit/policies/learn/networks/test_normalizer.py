import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from policies.learn.networks.normalizer import Normalizer


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(1, 50), min_size=1, max_size=5), st.integers(0, 1000))
def test_statistics_are_those_of_all_that_was_seen(sizes, seed):
    rng = np.random.default_rng(seed)
    batches = [rng.normal(100.0, 3.0, (size, 4)).astype(np.float32) for size in sizes]
    normalizer = Normalizer(4)
    for batch in batches:
        normalizer.update(torch.from_numpy(batch))
    observation = np.concatenate([np.zeros((1, 4)), *batches]).astype(np.float64)  # ML-Agents' first count: a zero
    mean = observation.mean(0)
    var = (((observation - mean) ** 2).sum(0) + 1.0) / len(observation)  # of variance 1
    assert np.allclose(normalizer.mean, mean, rtol=1e-6)
    assert np.allclose(normalizer.deviation, np.sqrt(var), rtol=1e-5)


def test_output_is_held_within_five_deviations():
    normalizer = Normalizer(1)
    normalizer.update(torch.tensor([[-1.0], [1.0], [0.0]]))
    assert normalizer(torch.tensor([[1e6], [-1e6]])).flatten().tolist() == [5.0, -5.0]


def test_inverse_undoes_it():
    normalizer = Normalizer(3)
    normalizer.update(torch.tensor([[1.0, 20.0, -7.0], [3.0, 80.0, -6.0]]))
    vectors = torch.tensor([[2.0, 50.0, 1.0]])
    assert torch.allclose(normalizer.inverse(normalizer.unbounded(vectors)), vectors)


def test_statistics_are_saved_with_the_network():
    first, second = Normalizer(2), Normalizer(2)
    first.update(torch.randn(10, 2, generator=torch.Generator().manual_seed(0)))
    second.load_state_dict(first.state_dict())
    vectors = torch.tensor([[0.3, -2.0]])
    assert torch.equal(first(vectors), second(vectors))
