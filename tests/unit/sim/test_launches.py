import pytest

from sim.launches import Workers


@pytest.mark.parametrize(("row_count", "threads"), [(1, 1), (7, 2), (64, 3), (2, 16)])
def test_every_row_is_in_one_chunk_and_every_chunk_is_done_once(row_count, threads):
    workers = Workers(row_count, threads)
    rows = [row for first, count in workers.chunks for row in range(first, first + count)]
    assert rows == list(range(row_count))
    assert len(workers.chunks) == min(row_count, threads)
    done = []
    workers.run(done.append)
    assert sorted(done) == list(range(len(workers.chunks)))
