"""An MCAP file read back without foxglove-sdk: by the `mcap` package and the schemas that the file brings."""

import json
from collections import defaultdict
from typing import NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from jsonschema import Draft202012Validator
from mcap.reader import make_reader


class Message(NamedTuple):
    """One message."""

    time_us: int
    schema: str
    value: object  # a protobuf message, or a dictionary that its JSON schema allows


def read(path):
    """Messages by topic, in the order of the file."""
    found, times, decoders = defaultdict(list), [], {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            if schema.id not in decoders:
                decoders[schema.id] = _decoder(schema)
            value = decoders[schema.id](message.data)
            found[channel.topic].append(Message(message.log_time // 1000, schema.name, value))
            times.append(message.log_time)
    assert times == sorted(times)
    return found


def _decoder(schema):
    if schema.encoding == "jsonschema":
        rules = json.loads(schema.data)
        Draft202012Validator.check_schema(rules)
        validator = Draft202012Validator(rules | {"additionalProperties": not rules["properties"]})

        def decode(data):
            value = json.loads(data)
            validator.validate(value)
            return value

        return decode
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
    return made.FromString


def us_of(stamp):
    """Simulated time of a time stamp."""
    return stamp.seconds * 1_000_000 + stamp.nanos // 1000
