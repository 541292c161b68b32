"""A new section is one file."""

from drone_rl.explanations import sections


def test_a_file_with_a_section_is_found(tmp_path, monkeypatch):
    (tmp_path / "tides.py").write_text("def section(context): return {'tides': context}, {}\n")
    monkeypatch.setattr(sections, "__path__", [*sections.__path__, str(tmp_path)])
    found = sections.find_sections()
    assert found["tides"](3) == ({"tides": 3}, {})
    assert {"evaluation", "dataset", "truth", "asymmetry"} < found.keys()
