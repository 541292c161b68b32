import json

import pytest

from benchmarks.ledger import Ledger, describe_machine, digest_code, make_origin
from drone_rl.utils.errors import InputError

SETTINGS = {"quick": True}


def store(path, name="tides", code="abc", **figures):
    ledger = Ledger(path)
    ledger.add(name, figures, make_origin(code, SETTINGS))
    return Ledger(path)


def test_the_file_holds_figures_by_key_and_their_origin(tmp_path):
    ledger = store(tmp_path / "r.json", tide_m=3.5, tides=[1, 2])
    content = json.loads((tmp_path / "r.json").read_text())
    assert content["tide_m"] == 3.5
    assert ledger.of("tides") == {"tide_m": 3.5, "tides": [1, 2]}
    origin = content["benchmarks"]["tides"]
    assert origin["keys"] == ["tide_m", "tides"]
    assert (origin["code"], origin["settings"]) == ("abc", {"quick": True})
    assert origin["machine"] == describe_machine()
    assert len(origin["date"]) == len("2026-11-21")


def test_a_benchmark_replaces_only_its_own_figures(tmp_path):
    store(tmp_path / "r.json", old=1, kept=1)
    store(tmp_path / "r.json", "moon", phase=2)
    ledger = store(tmp_path / "r.json", kept=3)
    assert ledger.figures == {"phase": 2, "kept": 3}
    assert ledger.of("sun") == {}


@pytest.mark.parametrize(
    ("code", "settings", "current"),
    [("abc", SETTINGS, True), ("abd", SETTINGS, False), ("abc", {"quick": False}, False)],
)
def test_figures_are_current_for_the_same_code_and_settings(tmp_path, code, settings, current):
    ledger = store(tmp_path / "r.json", a=1)
    assert ledger.is_current("tides", code, settings) is current
    assert not ledger.is_current("moon", code, settings)


def test_figures_of_another_machine_are_not_current(tmp_path, monkeypatch):
    ledger = store(tmp_path / "r.json", a=1)
    monkeypatch.setattr("benchmarks.ledger.num_cores", lambda: 1234)
    assert describe_machine().startswith("1234 cores, ")
    assert not ledger.is_current("tides", "abc", SETTINGS)


@pytest.mark.parametrize("content", ["[]", '{"benchmarks": {"a": {}}}', '{"benchmarks": {"a": 1}}'])
def test_a_file_of_another_kind_is_an_error(tmp_path, content):
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(InputError, match="not a benchmark results file"):
        Ledger(tmp_path / "r.json")


@pytest.fixture
def root(tmp_path):
    files = {"drone_rl/sim/a": "1", "drone_rl/sim/deep/b": "2", "benchmarks/c": "3"}
    for name, text in files.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "conf").mkdir()
    (tmp_path / "conf" / "train.yaml").write_text("seed: 0")
    return tmp_path


@pytest.mark.parametrize(
    ("changed", "counts"),
    [
        ("drone_rl/sim/a.py", True),
        ("drone_rl/sim/deep/b.py", True),
        ("benchmarks/c.py", False),
        ("conf/train.yaml", False),
        ("drone_rl/sim/notes.md", False),
    ],
)
def test_the_digest_depends_on_the_measured_modules_only(root, changed, counts):
    before = digest_code(["sim"], root)
    (root / changed).write_text("x")
    assert (digest_code(["sim"], root) != before) is counts


def test_the_digest_of_conf_depends_on_its_yaml_files(root):
    before = digest_code(["conf"], root)
    (root / "conf" / "train.yaml").write_text("seed: 1")
    assert digest_code(["conf"], root) != before


def test_the_digest_depends_on_module_names_but_not_on_their_order(root):
    both = digest_code(["sim", "benchmarks/c"], root)
    assert both == digest_code(["benchmarks/c", "sim"], root) != digest_code(["sim"], root)
    (root / "drone_rl" / "sim" / "a.py").rename(root / "drone_rl" / "sim" / "aa.py")
    assert digest_code(["sim", "benchmarks/c"], root) != both
    with pytest.raises(FileNotFoundError):
        digest_code(["nowhere"], root)
