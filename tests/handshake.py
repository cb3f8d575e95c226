"""HTTP requests and websocket handshakes byte by byte, with headers that no library would send."""

import base64
import os
import socket


def status(port: int, path: str = "/", *, method: str = "GET", timeout_s: float = 10.0, **headers: str | None) -> int:
    """The status of the answer to one request; 0: none, the connection was closed.

    Args:
        port: at the loopback address.
        path: what is asked for.
        method: how.
        timeout_s: of the answer.
        headers: `_` stands for `-`; Host is right unless it is given, None leaves it out.
    """
    lines = {"Host": f"127.0.0.1:{port}", **{name.replace("_", "-"): value for name, value in headers.items()}}
    text = "".join(f"{name}: {value}\r\n" for name, value in lines.items() if value is not None)
    with socket.create_connection(("127.0.0.1", port), timeout_s) as client:
        try:
            client.sendall(f"{method} {path} HTTP/1.1\r\n{text}\r\n".encode())
            answer = client.recv(4096)
        except ConnectionError:
            return 0
    return int(answer.split(b" ")[1]) if answer else 0


def websocket_status(port: int, path: str = "/", *, protocol: str, **headers: str | None) -> int:
    """The same of a websocket's handshake: 101 is open."""
    key = base64.b64encode(os.urandom(16)).decode()
    wanted = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Key": key, "Sec_WebSocket_Version": "13"}
    return status(port, path, **{**wanted, "Sec_WebSocket_Protocol": protocol, **headers})
