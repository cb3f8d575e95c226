"""FollowMe's settings: names and files of airframes with + between them."""

import shutil

import pytest

from common.airframe import AIRFRAME_FOLDER
from policies.tasks.catalogue import UnknownTask, settings_of


def airframes_of(text):
    return settings_of("FollowMe", (f"airframe={text}",)).airframes


def test_a_plus_is_between_airframes_or_in_the_path_of_a_file(tmp_path):
    folder = tmp_path / "mine+hers"
    folder.mkdir()
    one, other = folder / "a+b.toml", tmp_path / "c.toml"
    for path in (one, other):
        shutil.copy(AIRFRAME_FOLDER / "x500.toml", path)
    assert airframes_of("x500+f450") == ("x500", "f450")
    assert airframes_of(f"x500+{one}+{other}+f450") == ("x500", str(one), str(other), "f450")


@pytest.mark.parametrize("text", ["x500+none", "none+x500", "x500+none+f450"])
def test_an_airframe_that_there_is_not_is_refused_by_its_name(text):
    with pytest.raises(UnknownTask, match="unknown airframe 'none'"):
        airframes_of(text)
