"""The live page lets in who knows its address, and no page of another website: raw clients, and a real Chromium."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import create_connection

import msgspec
import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from mission.view.page import PageServer
from tests.browser import CHROMIUM, Browser
from tests.handshake import status, websocket_status

PROTOCOL = f"viser-v{viser.__version__}"
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [3.0, 3.0, 3.0], "fov": 1.0, "near": 0.1,
    "far": 100.0, "image_height": 480, "image_width": 640, "look_at": [0.0, 0.0, 0.0], "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip
KNOCK = """
(address) => new Promise(done => {
  const socket = new WebSocket(address, ["%s"]);
  socket.onopen = () => done("open");
  socket.onerror = () => done("refused");
})
"""


@pytest.fixture(scope="module")
def page():
    server = PageServer(0, "Honeyguide")
    yield server
    server.stop()


@pytest.fixture(scope="module")
def port(page):
    return page.get_port()


@pytest.fixture(scope="module")
def path(page, port):
    """What the websocket of the page asks for: its own address without the last slash."""
    return page.url.removeprefix(f"http://127.0.0.1:{port}").rstrip("/")


def test_each_start_has_an_address_of_its_own_that_cannot_be_guessed(page, port):
    other = PageServer(0, "Honeyguide")
    try:
        token, its = page.url.split("/")[3], other.url.split("/")[3]
        assert token != its
        assert len(token) >= 20
    finally:
        other.stop()


def test_the_page_and_its_websocket_need_the_token(port, path):
    assert status(port, f"{path}/") == 200
    assert websocket_status(port, path, protocol=PROTOCOL) == 101  # a program, which has no Origin
    assert websocket_status(port, path, protocol=PROTOCOL, Origin=f"http://127.0.0.1:{port}") == 101
    for wrong in ("/", "/x/", f"{path[:-1]}/", f"/x{path}/", "/index.html", f"{path}x/", "//", "/%00"):
        assert status(port, wrong) == 403, wrong
        assert websocket_status(port, wrong, protocol=PROTOCOL) == 403, wrong


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example", "http://evil.example", "null", "http://127.0.0.1:1", "http://localhost:{port}", "",
        "https://127.0.0.1:{port}", "http://127.0.0.1:{port}.evil.example", "http://127.0.0.1", "file://",
    ],
)  # fmt: skip
def test_a_foreign_origin_is_refused_even_with_the_token(port, path, origin):
    assert websocket_status(port, path, protocol=PROTOCOL, Origin=origin.format(port=port)) == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1.evil.example", "10.0.0.1", "", None]
)
def test_a_foreign_name_for_this_machine_is_refused(port, path, host):
    wanted = None if host is None else host.format(port=port)
    origin = f"http://{wanted}"  # after DNS rebinding the two agree
    assert websocket_status(port, path, protocol=PROTOCOL, Host=wanted, Origin=origin) in (400, 403)
    assert status(port, f"{path}/", Host=wanted) in (400, 403)


def test_names_of_this_machine_and_other_ports_of_tunnels_are_let_in(port, path):
    for host in (f"localhost:{port}", "localhost:9000", "127.0.0.1:9000", f"LocalHost:{port}"):
        assert websocket_status(port, path, protocol=PROTOCOL, Host=host, Origin=f"http://{host}") == 101, host


@pytest.mark.parametrize(
    ("site", "mode", "dest", "expected"),
    [
        ("none", "navigate", "document", 200),
        ("same-origin", "cors", "empty", 200),
        ("cross-site", "navigate", "document", 200),  # a link that somebody follows
        ("cross-site", "navigate", "iframe", 403),  # framed, its buttons could be clicked unseen
        ("cross-site", "no-cors", "script", 403),
        ("same-site", "cors", "empty", 403),
    ],
)
def test_another_website_may_link_to_the_page_and_not_embed_it(port, path, site, mode, dest, expected):
    headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode, "Sec-Fetch-Dest": dest}
    assert status(port, f"{path}/", **headers) == expected


def test_connections_beyond_the_bound_are_closed_and_the_page_answers_again(page, port, path):
    idle = [create_connection(("127.0.0.1", port)) for _ in range(300)]
    assert page.get_clients() == {}
    for connection in idle:
        connection.close()
    for _ in range(50):
        if (answer := status(port, f"{path}/")) == 200:
            break
    assert answer == 200


def test_messages_with_rubbish_in_them_do_not_reach_the_flight(page, port, path):
    with connect(f"ws://127.0.0.1:{port}{path}", subprotocols=[PROTOCOL], max_size=None) as client:
        for rubbish in (
            b"", b"\xc1", b"\x91" * 5000, msgspec.msgpack.encode([1]),
            msgspec.msgpack.encode({"type": "ShareUrlRequest"}),
            msgspec.msgpack.encode(CAMERA | {"position": ["a", "b", "c"]}),
            msgspec.msgpack.encode(CAMERA | {"look_at": [float("nan")] * 3}),
            msgspec.msgpack.encode(CAMERA | {"look_at": CAMERA["position"]}),
        ):  # fmt: skip
            client.send(rubbish)
        client.send(msgspec.msgpack.encode(CAMERA))
        until(lambda: len(page.get_clients()) == 1)
        (handle,) = page.get_clients().values()
        assert handle.camera.position.tolist() == CAMERA["position"]


def test_a_message_beyond_a_mebibyte_ends_its_connection(port, path):
    with connect(f"ws://127.0.0.1:{port}{path}", subprotocols=[PROTOCOL], max_size=None) as client:
        client.send(bytes(2 << 20))
        with pytest.raises(ConnectionClosed):
            while True:
                client.recv(timeout=20.0)


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: apt install chromium")
def test_a_page_of_another_website_in_chromium_is_refused(page, port, path, tmp_path):
    class Evil(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!DOCTYPE html><title>evil</title>")

        def log_message(self, *_):
            pass

    website = ThreadingHTTPServer(("127.0.0.1", 0), Evil)
    threading.Thread(target=website.serve_forever, daemon=True).start()
    browser = Browser(tmp_path, flags=("--host-resolver-rules=MAP evil.example 127.0.0.1",))

    def knocked(address):
        return browser.evaluate(f"({KNOCK % PROTOCOL})({address!r})")

    try:
        for name in ("127.0.0.1", "localhost", "evil.example"):
            browser.open(f"http://{name}:{website.server_address[1]}/")
            browser.wait("document.title === 'evil'")
            for address in (f"ws://127.0.0.1:{port}", f"ws://127.0.0.1:{port}{path}", f"ws://localhost:{port}{path}"):
                assert knocked(address) == "refused", (name, address)
        browser.open(f"http://evil.example:{port}{path}/")  # as after DNS rebinding
        browser.wait("document.body?.innerText.includes('not this machine')")
        browser.open(page.url)  # the control: our own page is let in
        browser.wait(f"location.port === '{port}' && document.title !== 'evil'")
        assert knocked(f"ws://127.0.0.1:{port}{path}") == "open"
        assert knocked(f"ws://127.0.0.1:{port}") == "refused"
    finally:
        browser.close()
        website.shutdown()
        website.server_close()


def until(condition):
    for _ in range(200):
        if condition():
            return
        threading.Event().wait(0.05)
    raise AssertionError("not in time")
