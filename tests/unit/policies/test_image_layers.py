"""Networks that look at images fly as they were trained: what runs their layers in flight gives the same numbers."""

import pytest
import torch

from policies.image_layers import as_flown
from policies.mono_depth.network import shipped as depth_network
from policies.person_detector.detector import LOW_WEIGHTS, WEIGHTS
from policies.person_detector.detector import shipped as detector_network
from policies.tasks.follow_me.observe import IMAGE_SIZE

PIXELS = torch.randint(0, 256, (8, IMAGE_SIZE, IMAGE_SIZE, 4), generator=torch.Generator().manual_seed(1)).byte()
ROUNDING = 1e-3  # of logits


@pytest.mark.parametrize("weights", [WEIGHTS, LOW_WEIGHTS])
def test_a_detector_says_in_flight_what_it_says_in_torch(weights):
    network = detector_network(weights).eval()
    with torch.inference_mode():
        for trained, flown in zip(network(PIXELS), as_flown(network)(PIXELS), strict=True):
            assert torch.allclose(trained, flown, atol=ROUNDING)


def test_depth_from_colours_is_in_flight_what_it_is_in_torch():
    network = depth_network().eval()
    given = PIXELS[..., :3], torch.rand(8, IMAGE_SIZE, IMAGE_SIZE, generator=torch.Generator().manual_seed(2))
    with torch.inference_mode():
        assert torch.allclose(network(*given), as_flown(network)(*given), atol=ROUNDING)


def test_a_network_stays_as_it_is_where_a_copy_of_it_flies():
    network = detector_network().train()
    before = [type(child) for child in network.children()]
    with torch.inference_mode():
        flown = as_flown(network)(PIXELS)[0]
    assert network.training
    assert [type(child) for child in network.children()] == before
    assert torch.allclose(network.eval()(PIXELS)[0], flown, atol=ROUNDING)
