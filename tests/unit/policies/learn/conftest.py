import pytest
import torch


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    """Threads only get in each other's way in networks as small as these."""
    torch.set_num_threads(1)
