"""The rig of the camera's tests."""

import pytest

from tests.unit.autopilot.mavlink.components.payload_rig import PayloadRig, Stream


@pytest.fixture
def rig(tmp_path):
    return PayloadRig(tmp_path / "media", Stream())
