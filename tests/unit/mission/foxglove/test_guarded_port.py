"""Who gets through the port in front of Foxglove's server; the connections themselves are in tests/system."""

from http.client import parse_headers
from io import BytesIO

import pytest

from mission.foxglove.guarded_port import hidden_address, refusal

TOKEN = "a-token"


def asked(line, *headers):
    return refusal(line.encode(), parse_headers(BytesIO("\r\n".join([*headers, "", ""]).encode())), TOKEN)


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost:8765", "localhost"])
def test_who_knows_the_address_gets_in_from_any_website(host):
    assert asked("GET /a-token HTTP/1.1", f"Host: {host}", "Origin: https://app.foxglove.dev") == ""


@pytest.mark.parametrize("path", ["/", "/a-toke", "/a-token/more", "/?a-token", "", "/\xff"])
def test_who_does_not_know_the_token_stays_out(path):
    assert asked(f"GET {path} HTTP/1.1", "Host: localhost") != ""


@pytest.mark.parametrize("headers", [("Host: evil.example",), (), ("Host: localhost", "Host: evil.example")])
def test_a_name_that_is_not_this_machines_stays_out(headers):
    assert asked("GET /a-token HTTP/1.1", *headers) == "Host: not this machine"


def test_only_a_get_can_become_a_websocket():
    assert asked("POST /a-token HTTP/1.1", "Host: localhost") == "not a GET"


def test_the_server_behind_is_each_time_elsewhere_on_loopback():
    found = {hidden_address() for _ in range(50)}
    assert len(found) > 45
    assert all(address.startswith("127.") and address != "127.0.0.1" for address in found)
