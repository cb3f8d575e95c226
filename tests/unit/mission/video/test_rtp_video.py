"""Live video: when there is some, and how that is said."""

import sys

import pytest

from mission.connections import open_video
from mission.console.option_checks import UserError
from mission.video.rtp_video import VideoError, check_encoder, session_description

HOST = "127.0.0.1"


def test_it_waits_for_a_client_unless_a_port_is_named():
    idle = open_video(None, HOST, may_wait=True)
    assert (idle.uri, idle.is_running) == ("5600", False)
    running = open_video(5610, HOST, may_wait=False)
    assert (running.uri, running.is_running) == ("5610", True)
    for video in (idle, running):
        video.close()


def test_there_is_none_where_none_is_wanted_or_nobody_can_start_it():
    assert open_video(0, HOST, may_wait=True) is None
    assert open_video(None, HOST, may_wait=False) is None


def test_without_pyav_who_asks_for_video_is_refused_and_who_does_not_flies(monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(UserError, match=r"^--video-port 5600: live video needs PyAV: pip install av$"):
        open_video(5600, HOST, may_wait=True)
    monkeypatch.setattr("mission.video.rtp_video.find_spec", lambda _: None)
    assert open_video(None, HOST, may_wait=True) is None


def test_an_encoder_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr("av.codecs_available", {"mpeg4"})
    with pytest.raises(VideoError, match=r"no H\.264 encoder"):
        check_encoder()


def test_players_are_told_address_port_and_codec():
    lines = session_description("127.0.0.1", 5600).split("\r\n")
    assert lines[0] == "v=0"
    assert "c=IN IP4 127.0.0.1" in lines
    assert "m=video 5600 RTP/AVP 96" in lines
    assert "a=rtpmap:96 H264/90000" in lines
