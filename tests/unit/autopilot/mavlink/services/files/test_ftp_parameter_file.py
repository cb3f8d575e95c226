"""The parameter file over file transfer: down, up, damaged and too large."""

import struct

import pytest
from pymavlink.mavftp import MAVFTP

from autopilot.mavlink.services.files.ftp import (
    Opcode,
)
from autopilot.mavlink.services.files.ftp_files import Nak
from tests.unit.autopilot.mavlink.rig import texts
from tests.unit.autopilot.mavlink.services.files.ftp_rig import reply_of


def test_parameter_file_is_what_pymavlink_reads(rig, ftp):
    decoded = MAVFTP.ftp_param_decode(ftp.read("@PARAM/param.pck"))
    assert [name.decode() for name, _, _ in decoded.params] == rig.vehicle.params.names
    with_defaults = MAVFTP.ftp_param_decode(ftp.read("@PARAM/param.pck?withdefaults=1"))
    assert len(with_defaults.defaults) == len(rig.vehicle.params)


def test_parameter_file_equals_the_list_bit_by_bit(rig, ftp):
    """PX4's own test of parameters by FTP."""
    decoded = MAVFTP.ftp_param_decode(ftp.read("@PARAM/param.pck"))
    layouts = {1: "<b", 2: "<h", 3: "<i", 4: "<f"}
    in_file = {name.decode(): struct.pack(layouts[kind], value).ljust(4, b"\0") for name, value, kind in decoded.params}
    rig.client.send("PARAM_REQUEST_LIST")
    in_list = {each.param_id: each.param_value.to_bytes(4, "little") for each in rig.all("PARAM_VALUE", 50)}
    assert in_file == in_list


def test_parameter_file_without_a_folder_is_there(rig, ftp):
    rig.vehicle.host.files = None
    assert len(ftp.read("/@PARAM/param.pck")) > 1000
    assert ftp.ask(Opcode.OPEN_FILE_RO, "a").error == Nak.FILE_NOT_FOUND
    assert ftp.ask(Opcode.CREATE_FILE, "a").error == Nak.FILE_PROTECTED
    assert ftp.ask(Opcode.LIST_DIRECTORY, "/").error == Nak.FILE_NOT_FOUND
    assert ftp.ask(Opcode.LIST_DIRECTORY, "@PARAM").data.startswith(b"Fparam.pck\t")


def upload(*entries):
    body = b"".join(
        bytes((own_type, len(name) - 1 << 4)) + name.encode() + struct.pack(layout, value)
        for name, own_type, layout, value in entries
    )
    return struct.pack("<HHH", 0x671B, len(entries), 6 + len(body)) + body


def test_uploaded_parameter_file_sets_parameters(rig, ftp):
    reply = ftp.write("@PARAM/param.pck", upload(("MIS_TAKEOFF_ALT", 4, "<f", 7.5), ("MAV_SYS_ID", 1, "<b", 3)))
    assert reply.opcode == Opcode.ACK
    assert rig.vehicle.params["MIS_TAKEOFF_ALT"] == 7.5
    assert rig.vehicle.params["MAV_SYS_ID"] == 3


@pytest.mark.parametrize("damage", [lambda data: data[:-2], lambda data: b"xx" + data[2:], lambda data: data[:3]])
def test_damaged_parameter_file_sets_nothing_and_says_so(rig, ftp, damage):
    before = rig.vehicle.params["MIS_TAKEOFF_ALT"]
    opened = ftp.ask(Opcode.CREATE_FILE, "@PARAM/param.pck")
    data = damage(upload(("MIS_TAKEOFF_ALT", 4, "<f", 7.5), ("MAV_SYS_ID", 1, "<b", 3)))
    ftp.ask(Opcode.WRITE_FILE, data, session=opened.session)
    ftp.send(Opcode.TERMINATE_SESSION, session=opened.session)
    messages = rig.frame()
    (reply,) = [reply_of(message.fields) for message in messages if message.name == "FILE_TRANSFER_PROTOCOL"]
    assert reply.error == Nak.FAIL
    assert texts(messages)[0].startswith("Parameter file not taken: ")
    assert rig.vehicle.params["MIS_TAKEOFF_ALT"] == before


def test_parameter_upload_is_bounded(ftp):
    opened = ftp.ask(Opcode.CREATE_FILE, "@PARAM/param.pck")
    reply = ftp.ask(Opcode.WRITE_FILE, b"x", session=opened.session, offset=70_000)
    assert reply.error == Nak.INVALID_DATA_SIZE
