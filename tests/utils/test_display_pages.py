"""What a page may load and run, and what its templates do with strings."""

import base64
import hashlib
import json

import jinja2
import pytest

from drone_rl.utils.display import (
    content_security_policy,
    folder_link,
    page_environment,
    static_text,
)

PAYLOAD = "</script><!--<img src=x onerror=\"alert('1')\">&\u2028"


def test_the_policy_names_hashes_and_nothing_unsafe():
    sources = dict(
        part.partition(" ")[::2] for part in content_security_policy("a{}", "f()").split("; ")
    )
    for name in ("default-src", "base-uri", "form-action", "object-src"):
        assert sources[name] == "'none'"
    assert sources["img-src"] == sources["media-src"] == "data:"
    digest = base64.b64encode(hashlib.sha256(b"f()").digest()).decode()
    assert sources["script-src"] == f"'sha256-{digest}'"
    assert sources["style-src"].startswith("'sha256-")
    assert "unsafe" not in " ".join(sources.values())


def test_a_page_without_a_script_allows_none():
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


def test_a_missing_value_is_an_error():
    with pytest.raises(jinja2.UndefinedError):
        page_environment("drone_rl.explanations.report").from_string("{{ x }}").render()


def test_static_files_are_joined_and_may_not_end_their_element():
    environment = page_environment("drone_rl.explanations.report")
    assert "setUp" in static_text(environment, ["map.js", "zoom.js"])
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
