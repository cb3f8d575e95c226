"""A hub passes messages on between an autopilot of others and who speaks to it."""

from autopilot.mavlink.hub import Hub
from autopilot.mavlink.transport.links import memory_pair
from autopilot.mavlink.wire.codec import FrameReader, encode

AUTOPILOT, SCRIPT, STATION = (1, 1), (245, 190), (255, 190)


def frames(link):
    reader = FrameReader()
    return [frame for data in link.receive() for frame in reader.feed(data)]


def heartbeat(source, seq=0):
    return encode("HEARTBEAT", *source, seq, type=2, autopilot=12, mavlink_version=3)


def command(source, target, seq=1):
    return encode("COMMAND_LONG", *source, seq, target_system=target[0], target_component=target[1], command=400)


def joined():
    ends = [memory_pair() for _ in range(3)]
    return Hub([hub_end for hub_end, _ in ends]), *(other for _, other in ends)


def test_what_is_for_all_reaches_all_but_who_sent_it():
    hub, autopilot, script, station = joined()
    autopilot.send(heartbeat(AUTOPILOT))
    hub.frame(0)
    assert [len(frames(link)) for link in (autopilot, script, station)] == [0, 1, 1]


def test_what_is_addressed_goes_where_that_was_heard_and_unchanged():
    hub, autopilot, script, station = joined()
    for link, who in ((autopilot, AUTOPILOT), (script, SCRIPT), (station, STATION)):
        link.send(heartbeat(who))
    hub.frame(0)
    for link in (autopilot, script, station):
        link.receive()
    sent = command(SCRIPT, AUTOPILOT)
    script.send(sent)
    hub.frame(20_000)
    assert autopilot.receive() == [sent]
    assert [len(frames(link)) for link in (script, station)] == [0, 0]


def test_rubbish_stops_there_and_everything_is_shown_to_who_logs():
    seen = []
    hub_end, autopilot = memory_pair()
    other_end, other = memory_pair()
    hub = Hub([hub_end, other_end], lambda time_us, frame, link: seen.append((time_us, frame.sysid, link is hub_end)))
    autopilot.send(b"rubbish")
    autopilot.send(heartbeat(AUTOPILOT))
    hub.frame(40_000)
    assert len(frames(other)) == 1
    assert seen == [(40_000, 1, True)]
