"""The world that the command line's options describe."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mission import flight_settings
from mission.console.model_command import option_fields
from mission.console.option_checks import UserError, check_owner
from mission.flight_config import FlightConfig
from mission.flight_options import flight_config
from mission.flight_settings import FOLLOWED_WITH, FlightOptions, FlightSettings, FollowOptions
from mission.simulator.flight_rig import flight_world
from policies.tasks.follow_me.world import FOLLOW_WORLD
from sim.world.driving_worlds import CAR_PARK, COURSE
from sim.world.forest_world import FOREST
from sim.world.world import build_world
from tests.documents import ROOT


def options(**changed):
    """`honeyguide fly` without any option, and what is changed."""
    return FlightOptions(**({"home": "47.397742,8.545594,488"} | changed))


@pytest.mark.parametrize("changed", [{"is_idle": True}, {"world_seed": 7, "trees_per_ha": 300.0}])
def test_no_tree_stands_within_80_m_of_home_and_some_do_beyond(changed):
    trees = build_world(flight_config(options(**changed), None).world).trees
    nearest_m = np.hypot(trees["north"], trees["east"]) - trees["crown_radius"]
    assert 80.0 < nearest_m.min() < 100.0


def test_the_world_of_an_owner_stays_that_of_training():
    world = flight_config(options(owner="walk", trees_per_ha=FOLLOW_WORLD.trees_per_ha), None).world
    assert world == FOLLOW_WORLD


def run_with(field: str, program: str) -> str:
    """What a program prints in a process in whose `FlightSettings` one more field is declared."""
    before, after = Path(flight_settings.__file__).read_text().split("\n\n\nclass FlightOptions(")
    source = f"{before}\n    {field}\n\n\nclass FlightOptions({after}"
    prepared = (
        "import sys, types\n"
        "module = sys.modules['mission.flight_settings'] = types.ModuleType('mission.flight_settings')\n"
        f"exec({source!r}, module.__dict__)\n{program}"
    )
    result = subprocess.run([sys.executable, "-c", prepared], capture_output=True, text=True, check=False, cwd=ROOT)
    return result.stdout + result.stderr


def test_an_option_is_declared_in_one_place():
    """The recipe for an option: one field of `FlightSettings`; the help, the bounds and the flight's configuration."""
    field = 'bird_count: int = option(3, "Birds in the air.", "--birds", ge=0, le=9)'
    shown = run_with(
        field,
        "from typer.testing import CliRunner\n"
        "from mission.cli import app\n"
        "for command in ('fly --help', 'fly --birds 10'):\n"
        "    print(CliRunner().invoke(app, command.split(), env={'COLUMNS': '120'}).output)\n"
        "from mission import fly_session\n"
        "def show(options):\n"
        "    from mission.flight_options import flight_config\n"
        "    print('birds:', flight_config(options, None).bird_count)\n"
        "    return 0\n"
        "fly_session.fly_session = show\n"
        "for command in ('fly', 'fly --birds 7'):\n"
        "    print(CliRunner().invoke(app, command.split(), catch_exceptions=False).output)\n",
    )
    assert "Birds in the air." in shown
    assert "[default: 3; 0<=x<=9]" in " ".join(shown.split())
    assert "Invalid value for '--birds'" in " ".join(shown.split())
    assert "birds: 3" in shown
    assert "birds: 7" in shown


def test_every_option_that_follow_names_is_a_field_with_a_flag():
    assert set(FOLLOWED_WITH) <= set(option_fields(FollowOptions))


def test_what_is_an_option_and_a_setting_has_one_default_and_one_range():
    """The command line and a script that builds a flight say the same."""
    for name in FlightSettings.model_fields:
        assert repr(FlightConfig.model_fields[name]) == repr(FlightOptions.model_fields[name])


@pytest.mark.parametrize(("kind", "made"), [("course", COURSE), ("car-park", CAR_PARK)])
def test_a_world_to_drive_in_is_made_from_its_seed_alone(kind, made):
    config = flight_config(options(world_kind=kind, world_seed=7, trees_per_ha=1.0), None)
    assert config.world == made.model_copy(update={"seed": 7})
    assert flight_world(config).boxes.rows.size > 0


def test_the_forest_is_that_of_training_and_its_vehicle_carries_the_scanner():
    config = flight_config(options(world_kind="forest", world_seed=7), None)
    assert config.world == FOREST.model_copy(update={"seed": 7, "trees_per_ha": 400.0})
    assert config.is_forest
    level = flight_config(options(world_kind="forest", trees_per_ha=200.0, hill_height_m=0.0), None).world
    assert (level.trees_per_ha, level.hill_height_m) == (200.0, 0.0)
    assert len(flight_world(config).trees) > 1000


def test_owners_do_not_walk_in_the_forest():
    with pytest.raises(UserError, match="--owner and --world forest: choose one"):
        check_owner(options(owner="walk", world_kind="forest"))
