"""Rows come one by one, and too many of them not at all."""

import pytest

from drone_rl.utils import readers
from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import TablesAllowance, read_table


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "a.csv"

    def write(content):
        path.write_bytes(content)
        return path

    return write


def test_rows_without_the_empty_ones(table):
    assert [*read_table(table(b'a,b\r\n1,"2,3"\r\n\r\n4,5'))] == [
        ["a", "b"],
        ["1", "2,3"],
        ["4", "5"],
    ]


def test_sizes_are_bounded(table, monkeypatch):
    path, allowance = table(b"a,b\n1,2\n3,4\n"), TablesAllowance(20)
    assert len([*read_table(path, allowance)]) == 3
    with pytest.raises(InputError, match="the 8 left of"):
        [*read_table(path, allowance)]
    monkeypatch.setattr(readers, "METRICS_ROWS", 1)
    with pytest.raises(InputError, match="more than 1 rows"):
        [*read_table(path)]
    monkeypatch.setattr(readers, "METRICS_ROWS", 9)
    monkeypatch.setattr(readers, "METRICS_CELLS", 2)
    with pytest.raises(InputError, match="more than 2 cells"):
        [*read_table(path)]


@pytest.mark.parametrize(
    ("allowance", "message"),
    [
        (TablesAllowance(rows=5), "3 rows, more than the 2 left of 5 rows"),
        (TablesAllowance(cells=5), "3 cells, more than the 2 left of 5 cells"),
    ],
)
def test_rows_and_cells_of_several_tables_are_bounded(table, allowance, message):
    path = table(b"a,b\n1,2\n3,4\n")
    assert len([*read_table(path, allowance)]) == 3
    with pytest.raises(InputError, match=message):
        [*read_table(path, allowance)]


def test_a_table_beyond_what_is_left_is_not_read(table, monkeypatch):
    path = table(b"a,b\n1,2\n")
    monkeypatch.setattr(readers, "read_bytes", None)
    with pytest.raises(InputError, match="8 bytes, more than 7 bytes"):
        [*read_table(path, TablesAllowance(7))]


@pytest.mark.parametrize("content", [b"a\xff\n", b"a\n" + b"b" * 200_000])
def test_what_is_no_table(table, content):
    with pytest.raises(InputError, match="no CSV"):
        [*read_table(table(content))]
