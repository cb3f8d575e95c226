import numpy as np
import pytest

from autopilot.estimator.state import EstimatorState
from autopilot.ports import Estimate, Samples
from common.records import late_reader, record_reader, row_reader


def rows_of(struct, count=3):
    """Rows whose every byte is different from its neighbours."""
    dtype = np.dtype(struct.numpy_dtype())
    return np.random.default_rng(1).integers(1, 120, count * dtype.itemsize, dtype=np.uint8).view(dtype)


def assert_same(record, row):
    """Every number of a record is that of the structured row."""
    assert record._fields == row.dtype.names
    for name in row.dtype.names:
        value, element = getattr(record, name), row[name]
        if row.dtype[name].names is not None:
            assert_same(value, element)
        elif row.dtype[name].shape:
            np.testing.assert_array_equal(np.array(value), element.reshape(-1))
        else:
            assert value == element or (value != value and element != element)


@pytest.mark.parametrize("struct", [Estimate, Samples, EstimatorState])
def test_record_holds_every_number_of_its_row(struct):
    rows = rows_of(struct)
    for i_row in range(len(rows)):
        assert_same(row_reader(rows, i_row, "Row")(), rows[i_row])
        assert_same(late_reader(rows, i_row, "Row")(), rows[i_row])


def test_rows_of_the_same_names_and_other_places_are_told_apart():
    """A reader is made once per type and name."""
    packed = np.dtype([("a", "<f4"), ("b", "<f4")])
    spread = np.dtype({"names": ["a", "b"], "formats": ["<f4", "<f4"], "offsets": [4, 12], "itemsize": 16})
    for dtype in (packed, spread):
        rows = np.zeros(2, dtype)
        rows["a"], rows["b"] = (1.0, 2.0), (3.0, 4.0)
        assert [tuple(row_reader(rows, i_row, "Row")()) for i_row in (0, 1)] == [(1.0, 3.0), (2.0, 4.0)]


def test_reader_follows_the_live_row():
    rows = np.zeros(2, dtype=np.dtype(Estimate.numpy_dtype()))
    read = row_reader(rows, 1, "Estimate")
    before = read()
    rows["pos_ned"][1] = (1.0, 2.0, 3.0)
    rows["time_us"][1] = 2**40
    assert read().pos_ned == (1.0, 2.0, 3.0)
    assert read().time_us == 2**40
    assert before.pos_ned == (0.0, 0.0, 0.0)


def test_fields_that_are_read_late_are_those_of_the_moment():
    rows = rows_of(Samples)
    expected = rows[1].copy()
    record = late_reader(rows, 1, "Samples")()
    rows[1] = rows[2]
    assert_same(record, expected)
    with pytest.raises(AttributeError, match="has no attribute 'wings'"):
        _ = record.wings


def test_part_of_a_row_is_read_by_its_path():
    rows = rows_of(EstimatorState)
    assert_same(row_reader(rows, 2, "Estimate", "estimate")(), rows["estimate"][2])
    assert_same(late_reader(rows, 2, "Estimate", "estimate")(), rows["estimate"][2])


def test_padding_between_fields_is_skipped():
    dtype = np.dtype([("flag", "i1"), ("value", "f8"), ("pair", "f4", (2,))], align=True)
    row = np.zeros(1, dtype)
    row["flag"], row["value"], row["pair"] = 3, 2.5, (1.0, -1.0)
    assert row_reader(row, 0, "Padded")() == (3, 2.5, (1.0, -1.0))


def test_plain_type_is_no_row():
    with pytest.raises(TypeError, match="Number is not a structured type"):
        record_reader(np.dtype("f4"), "Number")
