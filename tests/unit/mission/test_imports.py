import subprocess
import sys

import pytest


def imported(module: str) -> set[str]:
    code = f"import sys, {module}; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


@pytest.mark.parametrize("extra", ["policies", "gymnasium", "torch", "viser", "av", "pygame"])
def test_a_plain_flight_imports_no_policies_and_no_extra(extra: str, session_imports: set[str]) -> None:
    assert extra not in session_imports


@pytest.mark.parametrize(
    "heavy", ["autopilot.flight_controller", "matplotlib", "mission.flight", "policies", "sim.rig"]
)
def test_options_are_checked_before_anything_heavy_is_imported(heavy: str, option_imports: set[str]) -> None:
    assert heavy not in option_imports


def test_tasks_are_registered_with_gymnasium_before_their_kernels_are_imported() -> None:
    modules = imported("policies")
    assert "policies.tasks.catalogue" in modules
    assert "warp" not in modules


@pytest.fixture(scope="module")
def session_imports() -> set[str]:
    return imported("mission.fly_session")


@pytest.fixture(scope="module")
def option_imports() -> set[str]:
    return imported("mission.flight_options")
