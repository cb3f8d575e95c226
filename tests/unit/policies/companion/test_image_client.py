"""Images in memory, as bytes, and over a stream."""

import socket
import time
from contextlib import contextmanager

import numpy as np
import pytest

from common.image_stream import ImageFrame, ImageReader, ImageStreamError, frame_bytes
from policies.companion.image_client import FIRST_US, SILENT_US, CameraUrlError, MemoryCamera, StreamCamera


def frame(sequence=7, size=(4, 6, 4)):
    pixels = np.random.default_rng(sequence).integers(0, 256, size, dtype=np.uint8)
    return ImageFrame(123_456_789_012, sequence, pixels, 90.0, -10.0, 4.0)


def same(a, b):
    fields = ("time_us", "sequence", "hfov_deg", "pitch_deg", "depth_half_m")
    return all(getattr(a, name) == getattr(b, name) for name in fields) and np.array_equal(a.pixels, b.pixels)


@pytest.mark.parametrize("piece", [1, 13, 47, 48, 49, 1000])
def test_frames_come_out_as_they_went_in_however_the_stream_is_cut(piece):
    sent = [frame(k) for k in range(3)]
    data = b"".join(map(frame_bytes, sent))
    reader, received = ImageReader(), []
    for at in range(0, len(data), piece):
        received += reader.feed(data[at : at + piece])
    assert len(received) == 3
    assert all(map(same, sent, received))


def test_another_stream_is_refused():
    with pytest.raises(ImageStreamError, match="first bytes"):
        ImageReader().feed(b"HTTP/1.1 200 OK\r\n" + bytes(60))


def test_another_version_is_refused():
    data = bytearray(frame_bytes(frame()))
    data[4] = 9
    with pytest.raises(ImageStreamError, match="version 9"):
        ImageReader().feed(bytes(data))


def test_a_size_that_does_not_fit_is_refused():
    data = bytearray(frame_bytes(frame()))
    data[20] += 1
    with pytest.raises(ImageStreamError, match="does not have"):
        ImageReader().feed(bytes(data))


def test_a_picture_in_memory_is_taken_once_and_the_newest_only():
    camera = MemoryCamera()
    assert camera.take(0) is None
    camera.publish(frame(1))
    camera.publish(frame(2))
    assert camera.take(0).sequence == 2
    assert camera.take(0) is None


@pytest.mark.parametrize("url", ["", "127.0.0.1:14600", "udp://127.0.0.1:1", "tcp://host", "tcp://h:70000", "tcp://:5"])
def test_other_addresses_are_refused(url):
    with pytest.raises(CameraUrlError, match="must be tcp://HOST:PORT"):
        StreamCamera(url)


@contextmanager
def streaming():
    """A server, a camera that has taken a first frame from it, and their connection."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        camera = StreamCamera(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        camera.take(0)
        first, _ = server.accept()
        with first:
            first.sendall(frame_bytes(frame(1)))
            assert taken(camera, 100_000).sequence == 1
            yield server, camera, first
        camera.close()


def test_a_camera_that_falls_silent_without_a_goodbye_is_looked_for_again():
    with streaming() as (server, camera, _):
        camera.take(100_000 + SILENT_US)
        assert camera.trouble == ""
        camera.take(200_000 + SILENT_US)
        assert camera.trouble == "the camera is silent"
        camera.take(10 * SILENT_US)
        second, _ = server.accept()
        with second:
            slow_us = 10 * SILENT_US + FIRST_US
            assert camera.take(slow_us) is None
            second.sendall(frame_bytes(frame(2)))  # of a camera that begins with a connection what takes long
            assert taken(camera, slow_us).sequence == 2


def test_a_stream_of_another_encoding_gives_no_pictures_and_says_why():
    with streaming() as (_, camera, connection):
        connection.sendall(b"\xff\xd8\xff\xe0 a JPEG" + bytes(200))
        assert taken(camera, 200_000) is None
        assert "first bytes" in camera.trouble


def taken(camera, time_us):
    """The image that comes in about now; None after a second of waiting."""
    for _ in range(100):
        if (image := camera.take(time_us)) is not None:
            return image
        time.sleep(0.01)
    return None
