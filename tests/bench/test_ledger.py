import json

import pytest

from drone_rl.bench.ledger import Ledger, describe_machine, digest_code, make_origin
from drone_rl.utils.errors import InputError

SETTINGS = {"quick": True}


def note(path, name="tides", code="abc", **figures):
    ledger = Ledger(path)
    ledger.add(name, figures, make_origin(code, SETTINGS))
    return Ledger(path)


def test_figures_stand_by_their_keys_and_know_where_they_are_from(tmp_path):
    ledger = note(tmp_path / "r.json", tide_m=3.5, tides=[1, 2])
    content = json.loads((tmp_path / "r.json").read_text())
    assert content["tide_m"] == 3.5
    assert ledger.of("tides") == {"tide_m": 3.5, "tides": [1, 2]}
    origin = content["benchmarks"]["tides"]
    assert origin["keys"] == ["tide_m", "tides"]
    assert (origin["code"], origin["settings"]) == ("abc", {"quick": True})
    assert origin["machine"] == describe_machine()
    assert len(origin["date"]) == len("2026-11-21")


def test_each_benchmark_adds_and_replaces_its_own_alone(tmp_path):
    note(tmp_path / "r.json", old=1, kept=1)
    note(tmp_path / "r.json", "moon", phase=2)
    ledger = note(tmp_path / "r.json", kept=3)
    assert ledger.figures == {"phase": 2, "kept": 3}
    assert ledger.of("sun") == {}


@pytest.mark.parametrize(
    ("code", "settings", "current"),
    [("abc", SETTINGS, True), ("abd", SETTINGS, False), ("abc", {"quick": False}, False)],
)
def test_figures_are_current_for_the_same_code_and_settings(tmp_path, code, settings, current):
    ledger = note(tmp_path / "r.json", a=1)
    assert ledger.is_current("tides", code, settings) is current
    assert not ledger.is_current("moon", code, settings)


def test_figures_of_another_machine_are_not_current(tmp_path, monkeypatch):
    ledger = note(tmp_path / "r.json", a=1)
    monkeypatch.setattr("drone_rl.bench.ledger.num_cores", lambda: 1234)
    assert describe_machine().startswith("1234 cores, ")
    assert not ledger.is_current("tides", "abc", SETTINGS)


@pytest.mark.parametrize("content", ["[]", '{"benchmarks": {"a": {}}}', '{"benchmarks": {"a": 1}}'])
def test_another_file_is_refused(tmp_path, content):
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(InputError, match="no figures"):
        Ledger(tmp_path / "r.json")


@pytest.fixture
def package(tmp_path):
    for name, text in {"sim/a": "1", "sim/deep/b": "2", "bench/c": "3"}.items():
        path = tmp_path / "drone_rl" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf" / "train.yaml").write_text("seed: 0")
    return tmp_path / "drone_rl"


@pytest.mark.parametrize(
    ("changed", "counts"),
    [
        ("sim/a.py", True),
        ("sim/deep/b.py", True),
        ("bench/c.py", False),
        ("../conf/train.yaml", False),
        ("sim/notes.md", False),
    ],
)
def test_only_what_is_measured_counts(package, changed, counts):
    before = digest_code(["sim"], package)
    (package / changed).write_text("x")
    assert (digest_code(["sim"], package) != before) is counts


def test_settings_count_beside_the_package_or_in_it(package):
    before = digest_code(["conf"], package)
    (package.parent / "conf").rename(package / "conf")
    assert digest_code(["conf"], package) == before
    (package / "conf" / "train.yaml").write_text("seed: 1")
    assert digest_code(["conf"], package) != before


def test_a_module_or_a_name_that_moved(package):
    both = digest_code(["sim", "bench/c"], package)
    assert both == digest_code(["bench/c", "sim"], package) != digest_code(["sim"], package)
    (package / "sim" / "a.py").rename(package / "sim" / "aa.py")
    assert digest_code(["sim", "bench/c"], package) != both
    with pytest.raises(FileNotFoundError):
        digest_code(["nowhere"], package)
