"""The files of conf/ with defaults are generated from the settings classes."""

from typing import Annotated

import yaml

from drone_rl.utils.schema import Real
from drone_rl.utils.settings import Settings
from tools.conf import describe, main, make_text


def test_the_generated_files_are_current(capsys):
    assert main(["--check"]) == 0, f"run python -m tools.conf: {capsys.readouterr().out}"


class Some(Settings):
    rate: Annotated[float, Real(0.0)] = 1e-5
    """Learning rate; null for the default."""
    name: str | None = None
    """Name."""
    is_on: bool = True
    """Switch."""


def test_a_generated_file_keeps_its_head(tmp_path):
    path = tmp_path / "some.yaml"
    path.write_text("# Some settings.\ndefaults: [base_some, _self_]\n\nold: 3\n")
    text = make_text(path, Some)
    assert text.startswith(
        "# Some settings.\ndefaults: [base_some, _self_]\n\n# Learning rate; null"
    )
    assert yaml.safe_load(text)["rate"] == 1e-5
    assert "name: null\n# Switch.\nis_on: true\n" in text


def test_describe_writes_descriptions_above_settings():
    head = "# drone-rl some: an example.\ndefaults:\n  - base_some\n\n"
    descriptions = {
        "rate": "Learning rate; null for no learning.",
        "blur": "Blur.",
        "blur.width": "Width.",
    }
    old = "# Old words,\n# of two lines.\nrate: 7\nwidth: 8\n# Old.\nblur:\n  width: 9\n"
    new = (
        "# Learning rate; null for no learning.\nrate: 7\nwidth: 8\n"
        "# Blur.\nblur:\n  # Width.\n  width: 9\n"
    )
    assert describe(head + old, descriptions) == head + new
    assert describe("# Nothing below.\nrate: 7\n", descriptions) == "# Nothing below.\nrate: 7\n"


def test_a_stale_file_is_reported_and_rewritten(tmp_path, monkeypatch):
    path = tmp_path / "some.yaml"
    path.write_text("# Some settings.\n\nold: 3\n")
    monkeypatch.setattr("tools.conf.generated_files", lambda _: [(path, Some)])
    monkeypatch.setattr("tools.conf.described_files", lambda _: [])
    assert main(["--check"]) == 1 and "old" in path.read_text()
    assert main([]) == 0 and "old" not in path.read_text()
    assert main(["--check"]) == 0
