import re

import pytest

from common.airframe import AIRFRAME_FOLDER, AirframeError, airframe_names, load_airframe
from sim.bodies.vehicles import class_of

X500 = (AIRFRAME_FOLDER / "x500.toml").read_text()


@pytest.fixture
def load(tmp_path):
    """Loads the x500 with one replacement in its text."""

    def load_changed(old, new):
        assert X500.count(old) >= 1, old
        path = tmp_path / "mine.toml"
        path.write_text(X500.replace(old, new, 1))
        return load_airframe(str(path))

    return load_changed


@pytest.mark.parametrize("name", airframe_names())
def test_every_shipped_airframe_makes_a_body_and_a_controller(name):
    airframe = load_airframe(name)
    assert airframe.name == name
    vehicle, body = class_of(airframe)
    body.model(airframe, 0.0)
    vehicle.law.airframe_row(airframe)


def test_a_light_and_a_common_quadrotor_are_shipped():
    assert {"x500", "f450"} <= set(airframe_names())
    assert load_airframe("x500").body.mass_kg == 1.5


def test_every_number_has_a_source():
    numbers = re.findall(r"^\w+ = (.*)$", X500, re.MULTILINE)
    assert all('source = "' in number for number in numbers if not number.startswith('"'))


def test_changed_number_is_read(load):
    assert load("mass_kg = { value = 1.5,", "mass_kg = { value = 1.8,").body.mass_kg == 1.8


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass_kg = { value = 1.5,", "mass_kg = { value = -1.5,", r"body\.mass_kg: .*greater than 0"),
        ("mass_kg = { value = 1.5,", "mass_kg = { value = nan,", r"body\.mass_kg: .*finite"),
        ("mass_kg = { value = 1.5,", "mass_kg = { value = 'much',", r"body\.mass_kg: "),
        ("mass_kg = { value = 1.5,", "mass_kg = { value = 150.0,", r"the rotors lift 34\.2 N at most, .* 1\.47e\+03 N"),
        ("mass_kg = ", "mass = ", r"body\.mass_kg: Field required|body\.mass: Extra"),
        ("spin = { value = 1,", "spin = { value = 2,", r"rotors\.0\.spin: .*-1 or 1"),
        ("full_cell_v = { value = 4.2,", "full_cell_v = { value = 2.2,", r"battery: full_cell_v must be above"),
        ('cells = { value = 4, source = "', 'cells = { value = 4, unit = "', r"battery\.cells: must be \{ value = "),
        ("motor_efficiency = { value = 0.75,", "motor_efficiency = { value = 75,", r"battery\.motor_efficiency: "),
        ("[[rotors]] # 4: rear right", "[contact] #", r"not TOML|rotors"),
        ('name = "x500"', "name = ", r"not TOML"),
    ],
)
def test_wrong_file_is_refused_with_the_place(load, old, new, message):
    with pytest.raises(AirframeError, match=message) as refused:
        load(old, new)
    assert "mine.toml: " in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_no_text_is_refused(tmp_path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(AirframeError, match="not TOML"):
        load_airframe(str(path))


def test_what_is_nested_without_end_is_refused_in_one_sentence(tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text("a = " + "[" * 100_000)
    with pytest.raises(AirframeError, match=r"deep\.toml: not ") as refused:
        load_airframe(str(path))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["zeppelin", "", "none.toml", "/dev/null/x.toml"])
def test_unknown_airframe_is_refused_with_the_known_ones(name):
    known = "c172, easyglider, f450, f550, f550-fitted, plane, rover, rover-skid, ugv, x500, x500-fitted"
    with pytest.raises(AirframeError, match=f"unknown airframe '.*'; known: {known}$"):
        load_airframe(name)
