"""A short film of the page in a real browser."""

import shutil

import pytest

pytest.importorskip("selenium.webdriver")
pytest.importorskip("websockets")
if not shutil.which("chromedriver"):
    pytest.skip("no chromium with chromedriver on this machine", allow_module_level=True)

from PIL import Image

from tools import fly_film


def test_the_page_is_filmed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(fly_film, "MOVES", fly_film.MOVES[:2])
    monkeypatch.setattr(fly_film, "POLICY_FRAMES", 3)
    monkeypatch.setattr(fly_film, "TESTS_S", 0.0)
    assert fly_film.main(tmp_path / "fly.gif") == 0
    assert "fly.gif: 5 frames" in capsys.readouterr().out
    with Image.open(tmp_path / "fly.gif") as film:
        assert film.size[0] == 800
        assert 1 < film.n_frames <= 5  # equal frames are merged
