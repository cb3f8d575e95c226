"""The comparison of replayed flights with EKF2's answers, where EKF2's answer is the truth of a synthetic flight."""

import numpy as np
import pytest

from bench.estimate import main
from tests.unit.mission.estimate.synthetic_log import Flight, px4_tables, write_ulog

HEADER = "time_us,qw,qx,qy,qz,vn,ve,vd,pn,pe,pd"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A flight, and an answer that is the truth but for 0.2 m/s of velocity and an origin of its own."""
    folder = tmp_path_factory.mktemp("flights")
    flight = Flight(40.0)
    write_ulog(folder / "round.ulg", px4_tables(flight))
    rows = flight.every(0.02)
    half = flight.yaw[rows] / 2.0
    zero = np.zeros(len(rows))
    answer = [flight.time_us[rows], np.cos(half), zero, zero, np.sin(half)]
    answer += [*(flight.vel_ned[rows] + [0.2, 0.0, 0.0]).T, *(flight.pos_ned[rows] + [100.0, 200.0, -5.0]).T]
    np.savetxt(folder / "round.ekf2.csv", np.stack(answer, axis=1), "%.9g", ",", header=HEADER, comments="")
    return folder


def test_a_folder_of_flights_is_compared_with_ekf2(folder, capsys):
    assert main([str(folder)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    ours = next(line for line in lines if line[:3] == ["round", "ours", "EKF2"])
    tilt, _, tilt_most, tilt_verdict, yaw, _, _, *yaw_verdict, velocity, _, _, velocity_verdict, position, _, _ = ours[
        3:
    ]
    assert float(tilt) < 0.1
    assert float(tilt_most) < 0.33
    assert (tilt_verdict, yaw_verdict[-1], velocity_verdict) == ("in", "in", "out")
    assert float(yaw) < 0.7
    assert float(velocity) == pytest.approx(0.2, abs=0.03)
    assert float(position) < 0.3
    assert any(line[:3] == ["round", "EKF2", "log's"] for line in lines)


def test_what_cannot_be_compared_is_one_sentence(folder, tmp_path, capsys):
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"bench.estimate: {tmp_path}: no .ulg file in it\n"
    (tmp_path / "round.ulg").write_bytes((folder / "round.ulg").read_bytes())
    (tmp_path / "round.ekf2.csv").write_text("time_us,qw\n1,1\n")
    assert main([str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"bench.estimate: {tmp_path / 'round.ekf2.csv'}: no column qx\n"
