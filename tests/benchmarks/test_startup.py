"""Start-up times, with short programs instead of the commands."""

import pytest

from benchmarks import startup


def test_an_import_takes_less_than_a_second():
    assert 0 < startup.import_seconds() < 1.0


def test_a_training_is_timed_until_its_first_update(tmp_path, monkeypatch):
    code = "import sys, pathlib, time; f = pathlib.Path(sys.argv[-1].split('=')[1]); f.mkdir()\n"
    code += "(f / 'metrics.csv').write_text('update'); time.sleep(0.2)"
    monkeypatch.setattr(startup, "PROGRAM", ("python", "-c", code))
    assert startup.first_update_seconds(tmp_path / "run", "cpu") > 0


def test_the_kernel_cache_can_be_in_another_folder(tmp_path, monkeypatch):
    code = "import os, sys, pathlib; f = pathlib.Path(sys.argv[-1].split('=')[1]); f.mkdir()\n"
    code += "(f / 'metrics.csv').write_text(os.environ['WARP_CACHE_PATH'])"
    monkeypatch.setattr(startup, "PROGRAM", ("python", "-c", code))
    startup.first_update_seconds(tmp_path / "run", "cpu", tmp_path / "kernels")
    assert (tmp_path / "run" / "metrics.csv").read_text() == str(tmp_path / "kernels")


def test_a_training_that_ends_without_an_update_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(startup, "PROGRAM", ("python", "-c", "raise SystemExit(3)"))
    with pytest.raises(RuntimeError, match="status 3"):
        startup.first_update_seconds(tmp_path / "run", "cpu")


def test_figures_are_medians_of_three_after_a_warm_up(tmp_path, monkeypatch):
    seconds = iter([9.0, 12.0, 4.0, 5.0, 3.0])  # the second run compiles kernels
    monkeypatch.setattr(startup, "first_update_seconds", lambda *_: next(seconds))
    monkeypatch.setattr(startup, "verdict_seconds", lambda *_: 6.0)
    monkeypatch.setattr(startup, "import_seconds", lambda name="": 2.0 if name == "torch" else 0.1)
    assert startup.bench_startup(tmp_path, "cpu", quick=False) == {
        **{"import_s": 0.1, "start_to_first_update_s": 4.0, "verdict_s": 6.0},
        "first_compile_s": 8.0,
        **{"import_torch_s": 2.0, "start_to_first_update_scaled_s": 2.0, "verdict_scaled_s": 3.0},
        "first_compile_scaled_s": 4.0,
    }
