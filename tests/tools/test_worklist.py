"""Listing and sampling of mutants; needs Cosmic Ray, which `make mutants` installs."""

import json
import tomllib

import pytest

pytest.importorskip("cosmic_ray")

import cosmic_ray.plugins
from cosmic_ray.mutating import mutate_code
from cosmic_ray.work_db import WorkDB, use_db

from tools.mutants import results, worklist
from tools.mutants.operators import HalveNumber, SwapName

SOURCE = """\
def best(values: list | None, bonus: float = 0.5):
    if not values:
        raise ValueError(f"{len(values) + 1} values")
    return max(values) + bonus
"""


@pytest.fixture
def tree(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "module.py").write_text(SOURCE)
    return tmp_path


@pytest.fixture
def database(tree):
    with use_db(str(tree / "session.sqlite"), WorkDB.Mode.create) as found:
        yield found


def test_only_mutations_of_behaviour_are_listed(tree, database):
    worklist.fill(database, tree, ["module.py"], lambda mutants: mutants)
    sample, done, listed = worklist.sample_of(database, tree)
    assert listed == len(sample) and not done
    rows = [results.row(mutant, tree, {"outcome": "killed"}, {}, {}) for mutant in sample]
    changed = {(row["before"], " ".join(row["after"].split())) for row in rows}
    first, last = SOURCE.splitlines()[0], "return max(values) + bonus"
    assert (last, "return min(values) + bonus") in changed
    assert (last, "return max(values) - bonus") in changed
    assert (first, first.replace("0.5", "0.25")) in changed
    assert ("if not values:", "if values:") in changed
    assert not any("ValueError" in before or "&" in after for before, after in changed)
    assert not any("list" in after and "| None" not in after for _, after in changed)


def test_a_sample_is_a_subset_determined_by_the_seed(tree, database):
    def ids(seed, size):
        choose = lambda mutants: worklist.draw(mutants, tree, size, seed)  # noqa: E731
        worklist.fill(database, tree, ["module.py"], choose)
        return {mutant.id for mutant in worklist.sample_of(database, tree)[0]}

    first = ids(0, 5)
    assert len(first) == 5 and ids(0, 5) == first
    assert first < ids(0, 8) < ids(0, 1000)
    assert ids(1, 5) != first
    (tree / "module.py").write_text("import math\n\n\n" + SOURCE)
    assert ids(0, 5) == first  # moved lines keep their ids


@pytest.mark.parametrize(
    ("operator", "before", "after"),
    [
        (SwapName(), 'x["lower95"]', 'x["upper95"]'),
        (SwapName(), "x.all(-1)", "x.any(-1)"),
        (HalveNumber(), "x = 0.9", "x = 0.45"),
        (SwapName(), "min = 3", None),  # a local variable
        (HalveNumber(), "x = 1e-8", None),  # a tolerance
        (HalveNumber(), "x = 3", None),
    ],
)
def test_own_operators(operator, before, after):
    assert mutate_code(before, operator, 0) == after


def test_equivalent_mutants_do_not_count_in_the_score(tree, database):
    worklist.fill(database, tree, ["module.py"], lambda mutants: mutants[:4])
    sample, _, _ = worklist.sample_of(database, tree)
    reasons = {sample[0].id: "because", sample[1].id: "wrongly so"}
    outcomes = ("survived", "killed", "survived", "timeout")
    outputs = [{"outcome": outcome, "by": None} for outcome in outcomes]
    harms = {sample[0].id: "none", sample[2].id: "wrong figures"}
    rows = [results.row(m, tree, r, reasons, harms) for m, r in zip(sample, outputs, strict=True)]
    assert [row["outcome"] for row in rows] == ["equivalent", "killed", "survived", "timeout"]
    assert rows[0]["reason"] == "because" and "reason" not in rows[1]
    assert rows[2]["harm"] == "wrong figures" and "harm" not in rows[0]
    assert results.score(rows) == pytest.approx(2 / 3)
    results.write(tree / "kept.json", {"seed": 0}, rows)
    read = json.loads((tree / "kept.json").read_text())
    assert read["seed"] == 0 and read["score"] == pytest.approx(2 / 3)
    assert sorted(row["id"] for row in read["mutants"]) == sorted(row["id"] for row in rows)


def test_hashes_cover_files_and_folders(tree):
    (tree / "tests").mkdir()
    (tree / "tests" / "test_a.py").write_text("")
    found = results.hashes(tree, ["module.py", "tests"])
    assert list(found) == ["module.py", "tests/test_a.py"]
    assert found["tests/test_a.py"].startswith("e3b0c44298fc")  # SHA-256 of nothing


def test_merging_a_second_run_keeps_the_first_score(tree):
    outcomes = {"a": "killed", "b": "survived", "c": "survived"}
    first = [{"id": i, "module": "m", "line": 1, "outcome": o} for i, o in outcomes.items()]
    results.write(tree / "first.json", {"modules": {"m": "1"}}, first)
    again = [{**first[1], "outcome": "killed"}, first[2]]
    rows, score = results.merge(tree / "first.json", {"m": "1"}, again)
    assert [row["outcome"] for row in rows] == ["killed", "killed", "survived"]
    assert score == pytest.approx(1 / 3)  # the score of the first run
    results.write(tree / "second.json", {"modules": {"m": "1"}, "first_score": score}, rows)
    assert results.merge(tree / "second.json", {"m": "1"}, [])[1] == pytest.approx(1 / 3)
    with pytest.raises(ValueError, match="modules have changed"):
        results.merge(tree / "first.json", {"m": "2"}, again)


def test_each_id_is_listed_once():
    for name in ("equivalents", "harms"):
        text = (results.HERE / f"{name}.toml").read_text()
        ids = [id_ for entry in tomllib.loads(text).get("mutants", []) for id_ in entry["ids"]]
        assert len(ids) == len(set(ids)) == len(results.read_reasons(name))


def test_only_operators_that_keep_the_kind_are_used():
    names = cosmic_ray.plugins.operator_names()
    assert {"drone_rl/SwapName", "core/NumberReplacer", "core/AddNot"} <= set(names)
    assert "core/ReplaceBinaryOperator_Add_Sub" in names
    assert "core/ReplaceBinaryOperator_Add_LShift" not in names
