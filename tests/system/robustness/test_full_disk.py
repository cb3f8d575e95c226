"""A disk that is full in the middle of a flight: it is told once, and flown on to the landing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from pyulog import ULog

from autopilot.mavlink.wire.signing import FileStore, SigningConfig, SigningState
from common.clock import SIMULATED_EPOCH_US
from common.state_folder import StateFolder
from mission.flight import Flight, FlightConfig
from sim.world.world import WorldConfig
from tests.small_files import files_of_at_most

HONEYGUIDE = Path(sys.executable).with_name("honeyguide")
ROOM_BYTES = 64  # less than any file of a flight
ENDED = ("flight.ulg ended", "flight.tlog ended", "log_00001.ulg ended", "Signing key and time not stored")


def signed_flight(folder):
    store = FileStore(folder / "signing.json")
    store.save(SigningState(bytes(range(32)), 0))
    state = StateFolder(folder / "state")
    config = FlightConfig(world=WorldConfig(trees_per_ha=0.0), parameters={"SDLOG_MODE": 1})
    clock = SigningConfig(store, lambda: SIMULATED_EPOCH_US + flight.time_us)
    flight = Flight(config, folder=folder, state=state, signing=clock)
    return flight, state


def test_flight_goes_on_to_its_landing_when_the_disk_is_full(tmp_path):
    flight, state = signed_flight(tmp_path)

    async def climb(drone):
        await drone.wait_ready()
        await drone.arm()
        await drone.takeoff(5.0)

    async def fly_on(drone):
        await drone.sleep(70.0)  # the signing clock is stored once a minute
        await drone.set_parameter("MPC_XY_CRUISE", 4.0)
        await drone.goto_ned(10.0, 0.0, -5.0)
        await drone.land()

    assert flight.fly(climb, seconds=100.0).error is None
    count = flight.texts.count
    with files_of_at_most(ROOM_BYTES):
        running = flight.fly(fly_on, seconds=200.0)
        history = flight.close()
    state.close()
    texts = [text.text for text in flight.texts.since(count)]
    assert running.error is None
    assert running.is_done
    assert not history.is_armed[-1]
    for beginning in ENDED:
        assert sum(text.startswith(beginning) for text in texts) == 1, (beginning, texts)
    logged = ULog(str(tmp_path / "flight.ulg.part"))  # up to where there was room
    assert logged.get_dataset("vehicle_status").data["arming_state"][-1] == 2


def test_the_signing_clock_is_stored_once_there_is_room_again(tmp_path):
    flight, state = signed_flight(tmp_path)
    store = FileStore(tmp_path / "signing.json")
    with files_of_at_most(ROOM_BYTES):
        flight.fly(lambda drone: drone.sleep(70.0))
        before = store.load().timestamp
    flight.fly(lambda drone: drone.sleep(15.0))
    assert store.load().timestamp > before
    flight.close()
    state.close()


def test_command_flies_on_a_small_full_disk_and_says_what_is_missing(tmp_path):
    """A real file system of 3 MB, in a mount name space of its own; where that is not allowed, the others must do."""
    mount = ["unshare", "-rm", "sh", "-c", 'mount -t tmpfs -o size=3m tmpfs "$0" && exec "$@"', str(tmp_path)]
    if subprocess.run([*mount, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("mounting is not allowed here")
    (tmp_path / "state").mkdir()
    options = f"fly --speed max --once --state {tmp_path}/state --param SDLOG_MODE=1 --run-folder {tmp_path}/run"
    result = subprocess.run(
        [*mount, HONEYGUIDE, *options.split()],
        capture_output=True, text=True, check=False, timeout=300, env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip
    assert "Traceback" not in result.stderr + result.stdout
    assert result.stdout.count("ended: No space left on device") == 3, result.stdout
    assert "mission completed" in result.stdout
    assert "flight.png: not written: No space left on device" in result.stdout
    assert result.returncode == 1
