"""Explanations in Python; what they hold is tested in tests/explain."""

import dataclasses
from pathlib import Path

import pytest

import drone_rl
from drone_rl.explanations import explain as explaining
from drone_rl.explanations.explain import Explanations, _named
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed

SEED = RootSeed(6, is_fixed=False)


def test_policies_of_the_same_name_go_by_their_files():
    good = drone_rl.load_policy("good")
    other = dataclasses.replace(good, path=Path("elsewhere.safetensors"))
    assert list(_named([good, "poor"], "outputs")) == ["good", "poor"]
    assert list(_named(good, "outputs")) == ["good"]
    assert list(_named([good, other], "outputs")) == [str(good.path), "elsewhere.safetensors"]


def test_trained_policies_are_found_in_the_folder_of_outputs(tmp_path):
    with pytest.raises(InputError, match=f"{tmp_path}"):
        _named("latest", tmp_path)


@pytest.mark.parametrize("policies", [[], ["good", "good"]])
def test_each_policy_is_explained_once(policies):
    with pytest.raises(InputError, match="each once"):
        _named(policies, "outputs")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frames": 3}, "frames=3 is less than one for each episode"),
        ({"frames": "x"}, "frames='x'"),
        ({"perplexity": 500}, "perplexity=500 does not fit"),
        ({"num_envs": 0}, "num_envs=0"),
        ({"wind": 0}, "wind is unknown"),
    ],
)
def test_mistakes_name_the_argument(change, message, tmp_path):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.explain("good", folder=tmp_path, **change)


def test_all_policies_are_explained_from_one_fresh_seed(tmp_path, monkeypatch):
    seen = []

    def note(env, network, folder, settings, *, seed, **kwargs):
        states = env.base_env.state_dict()["random_states"]
        seen.append((seed, settings.seed, states[0]))
        return {"verdict": {"kind": "good", "certain": True, "sentence": "It does."}}

    monkeypatch.setattr(explaining, "explain_policy", note)
    monkeypatch.setattr(explaining, "write_report", lambda *args: tmp_path)
    how = {"folder": tmp_path, "num_envs": 2, "progress": silent}
    first = drone_rl.explain(["good", "poor"], **how)
    drone_rl.explain("good", **how)
    drone_rl.explain("good", seed=first.seed.value, **how)
    one, two, other, again = seen
    assert one == two
    assert (one[0], one[1]) == (first.seed, first.seed.value)
    assert (one[0].is_fixed, again[0].is_fixed) == (False, True)
    assert one[2] == again[2] != other[2]


def test_each_report_has_a_folder_of_its_own_and_its_path_is_printed(tmp_path, monkeypatch):
    verdict = {"kind": "good", "certain": True, "sentence": "It does."}
    monkeypatch.setattr(explaining, "explain_policy", lambda *_, **__: {"verdict": verdict})
    monkeypatch.setattr(explaining, "write_report", lambda _, folder: folder / "report.html")
    how = {"outputs": tmp_path, "num_envs": 2, "progress": silent}
    first, second = (drone_rl.explain("good", **how) for _ in range(2))
    assert first.folder.parent == second.folder.parent == tmp_path / "explain" / "runs"
    assert first.folder != second.folder
    assert f"report: {first.folder}/report.html" in str(first).splitlines()


def test_they_show_their_report(tmp_path):
    (tmp_path / "report.html").write_text("<h1>trusted?</h1>")
    verdict = {"kind": "good", "certain": False, "sentence": "It does."}
    shown = Explanations(tmp_path, tmp_path / "report.html", {"x": {"verdict": verdict}}, SEED)
    report = f"report: {tmp_path / 'report.html'}"
    assert str(shown).splitlines() == [
        "x: good (not certain). It does.",
        report,
        "environments: seed 6 (fresh)",
    ]
    assert shown._repr_html_().startswith(
        '<iframe sandbox="allow-scripts" srcdoc="&lt;h1&gt;trusted?'
    )
