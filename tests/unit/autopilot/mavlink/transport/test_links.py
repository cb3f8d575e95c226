from autopilot.mavlink.transport.links import LinkRole, memory_pair


def test_memory_link_carries_both_ways_in_order():
    vehicle, client = memory_pair()
    client.send(b"a")
    client.send(b"b")
    vehicle.send(b"c")
    assert list(vehicle.receive()) == [b"a", b"b"]
    assert list(vehicle.receive()) == []
    assert list(client.receive()) == [b"c"]


def test_memory_link_knows_the_client():
    vehicle, _ = memory_pair(LinkRole.ONBOARD)
    assert vehicle.role is LinkRole.ONBOARD
