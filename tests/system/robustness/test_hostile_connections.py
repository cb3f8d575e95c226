"""The ports that programs connect to, and those who connect to harm: strangers' pages, crowds, the silent, the slow."""

import os
import resource
import socket
import struct
import threading
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from autopilot.mavlink.transport.tcp_port import TcpPort
from autopilot.mavlink.transport.udp_port import UdpPort
from autopilot.mavlink.wire.codec import encode
from common.image_stream import ImageFrame, frame_bytes
from mission.follow.image_server import CLIENTS_MAX, GIVE_WAY_S, TAKE_S, ImageServer
from mission.net_guard import CONNECTIONS_MAX
from mission.video.mjpeg_server import StreamServer
from policies.companion.image_client import READS_MAX, StreamCamera
from tests.handshake import status

LOOPBACK = "127.0.0.1"
HELLO = encode("HEARTBEAT", 255, 190, 0, type=6, autopilot=8)
PICTURE = ImageFrame(0, 0, np.zeros((64, 64, 4), np.uint8), 60.0, 0.0, 5.0)
FRAME_S = 0.02


@pytest.fixture
def mjpeg(tmp_path):
    """The server, whose camera stores its media in the folder `media`; nobody renders."""
    media = SimpleNamespace(files=lambda: [*(tmp_path / "media").iterdir()])
    server = StreamServer(0)
    server.start(SimpleNamespace(media=media), None)
    (tmp_path / "media").mkdir()
    yield server, int(server.page_uri.split(":")[2].rstrip("/"))
    server.close()


def connected(port, stack, count=1):
    return [stack.enter_context(socket.create_connection((LOOPBACK, port), 5.0)) for _ in range(count)]


@pytest.mark.parametrize("path", ["/", "/camera.xml", "/stream.mjpg", "/still.jpg", "/media/x"])
def test_the_live_picture_is_for_no_page_of_another_website(mjpeg, path):
    port = mjpeg[1]
    for host in ("evil.example", f"evil.example:{port}", "", None, "169.254.1.1", f"{LOOPBACK}.example"):
        assert status(port, path, Host=host) == 403, host
    for origin in ("https://evil.example", "null", "http://127.0.0.1:1", f"https://127.0.0.1:{port}"):
        assert status(port, path, Origin=origin) == 403, origin
    for site in ("cross-site", "same-site"):
        assert status(port, path, Sec_Fetch_Site=site, Sec_Fetch_Mode="no-cors", Sec_Fetch_Dest="image") == 403, site
    assert status(port, path, method="POST") == 501


def test_the_live_picture_is_for_this_machine(mjpeg):
    port = mjpeg[1]
    for host in (f"{LOOPBACK}:{port}", f"localhost:{port}", "localhost:9000", f"[::1]:{port}"):
        assert status(port, "/", Host=host) == 200
    assert status(port, "/", Origin=f"http://{LOOPBACK}:{port}", Sec_Fetch_Site="same-origin") == 200
    link = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}
    assert status(port, "/", **link) == 200  # somebody has clicked on a link


def test_a_thousand_half_requests_cost_the_live_picture_a_bounded_number_of_threads(mjpeg, capfd):
    port, before = mjpeg[1], threading.active_count()
    with ExitStack() as stack:
        for _ in range(20):
            for idle in connected(port, stack, 50):
                idle.sendall(b"GET / HTTP/1.1\r\n")
            assert threading.active_count() <= before + CONNECTIONS_MAX + 8  # those let go may still be ending
        assert status(port, "/") == 200
    assert capfd.readouterr().err == ""


def test_resets_and_rubbish_print_nothing(mjpeg, capfd):
    port = mjpeg[1]
    for data in (
        b"",
        b"GET",
        b"GET / HTTP/1.1\r\n\r\n",
        b"GET /stream.mjpg HTTP/1.1\r\nHost: localhost\r\n\r\n",
        bytes(1 << 17),
    ):
        for _ in range(5):
            client = socket.create_connection((LOOPBACK, port))
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # close is a reset
            client.sendall(data)
            client.close()
    assert status(port, "/") == 200
    assert capfd.readouterr().err == ""


class Cameras:
    """An image server on a clock of the test's, and the pictures it sends at each frame."""

    def __init__(self):
        self.now_s = 0.0
        self.server = ImageServer(0, clock=lambda: self.now_s)

    def run(self, seconds, each_frame=lambda: None):
        for i in range(round(seconds / FRAME_S)):
            self.now_s += FRAME_S
            self.server.frame(0)
            if i % 3 == 0:
                self.server.publish(PICTURE)
            each_frame()


@pytest.fixture
def cameras():
    made = Cameras()
    yield made
    made.server.close()


def test_a_crowd_that_does_not_read_gives_way_to_the_companion(cameras):
    with ExitStack() as stack:
        connected(cameras.server.port, stack, CLIENTS_MAX)
        cameras.run(2.0)
        companion = StreamCamera(cameras.server.url)
        pictures = []

        def take():
            if (picture := companion.take(round(cameras.now_s * 1e6))) is not None:
                pictures.append(picture)

        cameras.run(3.0 + GIVE_WAY_S, take)
        assert len(pictures) > 20
        assert len(cameras.server._clients) <= CLIENTS_MAX
        companion.close()


def test_who_takes_no_picture_is_let_go_and_who_reads_stays(cameras):
    with ExitStack() as stack:
        silent, reader = connected(cameras.server.port, stack, 2)
        reader.setblocking(False)
        taken = bytearray()

        def read():
            try:
                taken.extend(reader.recv(1 << 20))
            except BlockingIOError:
                return

        cameras.run(TAKE_S + 8.0, read)
        assert len(cameras.server._clients) == 1
        assert len(taken) > 50 * PICTURE.pixels.nbytes
        silent.settimeout(5.0)
        while True:  # what had been sent, and the end
            if not silent.recv(1 << 20):
                break


def test_a_browser_gets_no_pictures(cameras):
    with ExitStack() as stack:
        (browser,) = connected(cameras.server.port, stack)
        browser.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        time.sleep(0.01)
        cameras.run(1.0)
        assert cameras.server._clients == {}


def test_a_thousand_connections_to_the_pictures_leave_their_reader_in_peace(cameras):
    companion, count = StreamCamera(cameras.server.url), 0

    def take():
        nonlocal count
        count += companion.take(round(cameras.now_s * 1e6)) is not None

    cameras.run(0.2, take)
    with ExitStack() as stack:
        for _ in range(100):
            for _ in range(10):
                crowd = stack.enter_context(socket.socket())
                crowd.setblocking(False)
                crowd.connect_ex((LOOPBACK, cameras.server.port))
            cameras.run(0.06, take)
    assert count > 90
    assert len(cameras.server._clients) <= CLIENTS_MAX
    companion.close()


def test_a_camera_that_floods_holds_up_no_step_of_the_companion():
    data = frame_bytes(PICTURE)
    with socket.socket() as listener:
        listener.bind((LOOPBACK, 0))
        listener.listen(1)
        camera = StreamCamera(f"tcp://{LOOPBACK}:{listener.getsockname()[1]}")
        camera.take(0)
        flood = listener.accept()[0]
        is_over = threading.Event()

        def send():
            while not is_over.is_set():
                try:
                    flood.sendall(data * 16)
                except OSError:
                    return

        thread = threading.Thread(target=send)
        thread.start()
        reads = []
        read = camera._read
        camera._read = lambda: reads.append(1) or read()
        for i in range(50):
            reads.clear()
            camera.take(i * 100_000)
            assert len(reads) <= READS_MAX
        is_over.set()
        camera.close()
        flood.close()
        thread.join()


@contextmanager
def no_descriptors():
    """As when somebody else has used them all up."""
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    highest = max(int(entry.name) for entry in Path("/proc/self/fd").iterdir())
    with ExitStack() as stack:
        for _ in range(highest):  # so that no number below the limit is free
            spare = os.open("/dev/null", os.O_RDONLY)
            stack.callback(os.close, spare)
            if spare > highest:
                break
        resource.setrlimit(resource.RLIMIT_NOFILE, (spare, limits[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)


@pytest.mark.parametrize("kind", ["udp", "tcp", "pictures"])
def test_without_descriptors_nobody_comes_in_and_the_flight_goes_on(kind):
    port = {"udp": lambda: UdpPort(9), "tcp": lambda: TcpPort(0), "pictures": lambda: ImageServer(0)}[kind]()
    look = port.frame if kind == "pictures" else port.poll
    with ExitStack() as stack:
        clients = [
            stack.enter_context(socket.socket(type=socket.SOCK_DGRAM if kind == "udp" else socket.SOCK_STREAM))
            for _ in range(8)
        ]
        number = port.port if kind == "pictures" else port.local_port
        with no_descriptors():
            for client in clients:
                client.connect((LOOPBACK, number))
                client.send(HELLO)
            for i in range(10):
                look(i)
        for client in clients if kind == "udp" else ():  # whose first datagrams were lost
            client.send(HELLO)
        look(20)
        look(21)
        if kind != "pictures":  # of which a client that says anything is closed
            assert len(port.links) >= 1 + (kind == "udp")
    port.close()


def test_without_descriptors_the_live_picture_waits_and_then_answers(mjpeg):
    with ExitStack() as stack:
        client = stack.enter_context(socket.socket())
        with no_descriptors():
            client.connect((LOOPBACK, mjpeg[1]))
            before_s = time.process_time()
            time.sleep(0.5)
            assert time.process_time() - before_s < 0.3  # it does not spin
        client.sendall(b"GET / HTTP/1.0\r\nHost: localhost\r\n\r\n")
        client.settimeout(5.0)
        assert b"200 OK" in client.recv(1000)
