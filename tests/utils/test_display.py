import dataclasses

from matplotlib.figure import Figure

from drone_rl.utils.display import Result, aligned, page, paragraph, picture, table

NASTY = '<script>alert("x")</script>'


def test_whatever_a_file_says_is_shown_as_text():
    for shown in (table([NASTY], [[NASTY]]), paragraph(NASTY), page(NASTY)):
        assert "<script>" not in shown
        assert "&lt;script&gt;" in shown


def test_a_table():
    assert table(["a", "b"], [["1", "2"]]) == (
        "<table><thead><tr><th>a</th><th>b</th></tr></thead>"
        "<tbody><tr><td>1</td><td>2</td></tr></tbody></table>"
    )


def test_texts_stand_at_the_left_and_figures_at_the_right():
    rows = [["", "a", "bcd"], ["share", "10", ""], ["x", "2", "3"]]
    assert aligned(rows).splitlines() == ["       a   bcd", "share  10", "x      2   3"]
    assert aligned(rows, are_numbers=True).splitlines() == [
        "          a  bcd",
        "share    10",
        "x         2    3",
    ]


def test_a_picture_needs_no_file():
    assert picture(Figure(figsize=(1, 1))).startswith('<img src="data:image/png;base64,iVBOR')


def test_a_result_shows_its_text_at_a_prompt():
    @dataclasses.dataclass(frozen=True)
    class Rate(Result):
        pixels: list[int]

        def __str__(self):
            return "success 50%"

    assert repr(Rate([0] * 1000)) == "success 50%"
    assert repr([Rate([1])]) == "[success 50%]"
