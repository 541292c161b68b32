import dataclasses
import json

import jinja2
import pytest
from matplotlib.figure import Figure

from drone_rl.utils.display import (
    Result,
    aligned,
    content_security_policy,
    folder_link,
    page,
    page_environment,
    paragraph,
    picture,
    static_text,
    table,
)

NASTY = '<script>alert("x")</script>'


def test_texts_of_files_are_escaped():
    for shown in (table([NASTY], [[NASTY]]), paragraph(NASTY), page(NASTY)):
        assert "<script>" not in shown
        assert "&lt;script&gt;" in shown


def test_columns_are_aligned():
    rows = [["", "a", "bcd"], ["share", "10", ""], ["x", "2", "3"]]
    assert aligned(rows).splitlines() == ["       a   bcd", "share  10", "x      2   3"]
    assert aligned(rows, are_numbers=True).splitlines() == [
        "          a  bcd",
        "share    10",
        "x         2    3",
    ]


def test_figures_are_embedded():
    assert picture(Figure(figsize=(1, 1))).startswith('<img src="data:image/png;base64,iVBOR')


def test_the_repr_of_a_result_is_its_text():
    @dataclasses.dataclass(frozen=True)
    class Rate(Result):
        pixels: list[int]

        def __str__(self):
            return "success 50%"

    assert repr(Rate([0] * 1000)) == "success 50%"
    assert repr([Rate([1])]) == "[success 50%]"


PAYLOAD = "</script><!--<img src=x onerror=\"alert('1')\">&\u2028"


def test_pages_without_script_allow_none():
    assert "script-src 'none'" in content_security_policy("a{}")


def test_values_are_escaped_in_text_attributes_and_data():
    environment = page_environment("drone_rl.explanations.report")
    template = environment.from_string(
        '<p title="{{ x }}">{{ x }}</p><script type="application/json">{{ [x]|tojson }}</script>'
    )
    page = template.render(x=PAYLOAD)
    assert page.count("<") == 4 and "<!--" not in page and "\u2028" not in page.split("json")[1]
    data = page.split('json">')[1].removesuffix("</script>")
    assert json.loads(data) == [PAYLOAD]


def test_static_files_are_joined_and_may_not_end_their_element():
    environment = page_environment("drone_rl.explanations.report")
    assert "setUp" in static_text(environment, ["map.js"])
    environment.loader = jinja2.DictLoader({"a.js": "1\r\n", "b.js": "'</script>'"})
    assert static_text(environment, ["a.js"]) == "1\n"
    with pytest.raises(ValueError, match="would end the element"):
        static_text(environment, ["b.js"])


@pytest.mark.parametrize(
    ("name", "link"),
    [
        ("2", "./2/"),
        ("lr 0.1/2", "./lr%200.1/2/"),
        ("javascript:alert(1)", "./javascript%3Aalert%281%29/"),
        ("//evil.invalid/x", ".///evil.invalid/x/"),
        ('"><script>', "./%22%3E%3Cscript%3E/"),
    ],
)
def test_a_link_to_a_folder_is_relative_whatever_its_name(name, link):
    assert folder_link(name) == link
