"""A ground station at the other end of a memory link, with pymavlink's encoding."""

from pymavlink.dialects.v20 import all as mavlink


class Station:
    """A ground station that keeps what it hears."""

    def __init__(self, link):
        self.link = link
        self.reader = mavlink.MAVLink(None)
        self.writer = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self.heard = []

    def command(self, number, *params):
        self.receive()
        fields = [*params, *[0.0] * (7 - len(params))]
        self.link.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *fields).pack(self.writer))

    def receive(self):
        for data in self.link.receive():
            self.heard += self.reader.parse_buffer(data) or []
        return self.heard
