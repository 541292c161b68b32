"""Finding and building a firmware, with a source of one line."""

import pytest

from drone_rl.flight.betaflight import build
from drone_rl.flight.betaflight.build import build_firmware, find_firmware
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
