"""Scripts that run on a page are detected, and none runs on the program's pages."""

import shutil

import pytest

from benchmarks import injections
from benchmarks.injections import HOST, PAYLOADS, RAN
from tests.explanations.quick import quick_figures
from tests.explanations.report.conftest import explanations  # noqa: F401

pytest.importorskip("selenium.webdriver")
if not (shutil.which("chromium") and shutil.which("chromedriver")):
    pytest.skip("no chromium with chromedriver on this machine", allow_module_level=True)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with injections.chromium(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.mark.parametrize(
    ("content", "ran"),
    [
        ("<p>nothing</p>", ""),
        (f"<script>{RAN}</script>", "a script"),
        (f"<img src=x onerror={RAN}>", "a script"),
        (f"<x onclick={RAN}>x</x>", "a script"),
        ("<script>alert(1)</script>", "a dialog"),
        (f"<img src=http://{HOST}/1.png>", "a request"),
        ("<script>nothing()</script>", "an error"),
        (f"<a href='javascript:{RAN}'>x</a>", "1 elements"),
        ("<base href=http://ran.invalid/>", "1 elements"),
    ],
)
def test_scripts_and_requests_are_detected(browser, tmp_path, content, ran):
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><html><head></head><body>{content}</body></html>")
    found = injections.what_ran(browser, page)
    assert found.startswith(ran) if content.startswith("<p>") is False else found == ""


def test_a_blocked_script_is_detected_unless_it_is_markup_on_purpose(browser, tmp_path):
    page = tmp_path / "page.html"
    policy = "<meta http-equiv=Content-Security-Policy content=\"default-src 'none'\">"
    page.write_text(f"<html><head>{policy}</head><body><script>{RAN}</script></body></html>")
    assert "an error" in injections.what_ran(browser, page)
    assert injections.what_ran(browser, page, is_markup=True) == ""


@pytest.mark.slow
def test_nothing_runs_on_the_programs_pages(explanations, tmp_path):  # noqa: F811
    few = [PAYLOADS[7], f'"></script><script>{RAN}</script>']  # markup; attributes and scripts
    with quick_figures():
        outcomes = injections.open_all(tmp_path, explanations[1], few, names=False)
    assert {outcome["page"] for outcome in outcomes} == {
        "report", "report_of_files", "report_without_policy", "sweep", "sweep_without_policy",
        "notebook", "markup_under_policy",
    }  # fmt: skip
    assert [outcome for outcome in outcomes if outcome["ran"]] == []


def test_the_settings_of_the_explanation_are_valid(tmp_path, monkeypatch):
    calls = []

    def explain(policy, settings, *, folder, **_):
        calls.append((policy, settings.frames))
        (folder / "good").mkdir(parents=True)
        (folder / "good" / "explanation.json").touch()
        return type("Result", (), {"folder": folder})

    monkeypatch.setattr("drone_rl.explanations.explain.explain", explain)
    assert injections.explained(tmp_path) == tmp_path / "explained" / "good"
    assert calls == [("good", 180)]


def test_payloads_that_run_are_counted(tmp_path, monkeypatch):
    outcomes = [{"page": "a", "payload": "b", "ran": ran} for ran in ("", "a script", "")]
    monkeypatch.setattr(injections, "open_all", lambda *_: outcomes)
    assert injections.bench_injections(tmp_path, tmp_path) == {
        "injections_run": 1,
        "injections_total": 3,
    }
