import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import parse_yaml, read_table, read_yaml


def test_plain_yaml_is_read(tmp_path):
    (tmp_path / "a.yaml").write_text("fog: {low: 40, high: null, unit: m of sight}\nsun: [1, -2.5]")
    expected = {"fog": {"low": 40, "high": None, "unit": "m of sight"}, "sun": [1, -2.5]}
    assert read_yaml(tmp_path / "a.yaml") == expected


@pytest.mark.parametrize(
    "text",
    [
        "a: &a [1]\nb: *a",
        "!!python/object/apply:os.system [x]",
        '!!int ""',
        "[" * 20_000,
        "2001-99-99",
        "a: \x00",
        "--- a\n--- b",
    ],
)
def test_other_yaml_is_refused_in_one_line(text):
    with pytest.raises(InputError, match=r"no (plain )?YAML") as error:
        parse_yaml(text, "x")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("b: 1\na: [1", "line 2 of x"),
        ("b: 0\na: 1\nc: 2\na: 2", "line 4 of x .*a occurs twice"),
        ("a:\n\tb: 1", "line 2 of x .*tabs"),
    ],
)
def test_the_line_of_a_yaml_mistake_is_named(text, message):
    with pytest.raises(InputError, match=message):
        parse_yaml(text, "x")


def test_rows_of_a_table_without_empty_ones(tmp_path):
    (tmp_path / "a.csv").write_bytes(b'a,b\r\n1,"2,3"\r\n\r\n4,5')
    assert [*read_table(tmp_path / "a.csv")] == [["a", "b"], ["1", "2,3"], ["4", "5"]]


@pytest.mark.parametrize("content", [b"a\xff\n", b"a\n" + b"b" * 200_000])
def test_files_that_are_no_tables_are_refused(tmp_path, content):
    (tmp_path / "a.csv").write_bytes(content)
    with pytest.raises(InputError, match="no CSV"):
        [*read_table(tmp_path / "a.csv")]
