import pytest

from benchmarks import scaling
from benchmarks.scaling import bench_scaling


def test_r_squared_is_one_for_a_straight_line_only():
    assert scaling._r_squared({1: 3.0, 2: 5.0, 4: 9.0}) == pytest.approx(1.0)
    # by hand: the fit to 0, 0, 3 at 0, 1, 2 has residual sum of squares 1.5; the total is 6
    assert scaling._r_squared({0: 0.0, 1: 0.0, 2: 3.0}) == pytest.approx(1 - 1.5 / 6)


def test_times_are_measured_by_environments_frames_cubes_and_pixels(monkeypatch, tmp_path):
    def make_drone_env(n, device, cubes=3, camera=None):
        return n, cubes * (camera.width if camera else 1)

    monkeypatch.setattr(scaling, "make_drone_env", make_drone_env)
    monkeypatch.setattr(scaling, "_seconds", lambda env, steps, _: env[0] * env[1] * steps)
    found = bench_scaling(tmp_path, "cpu", quick=True)["scaling"]
    assert found["environments"]["sizes"] == [32, 64, 128]
    assert found["environments"]["seconds"] == [480, 960, 1920]
    assert found["frames"]["sizes"] == [320, 640, 960]
    assert found["frames"]["r_squared"] == pytest.approx(1.0)
    assert found["cubes"]["sizes"] == [1, 4, 8]
    assert found["pixels"]["sizes"] == [1600, 6400, 14400]
    assert found["pixels"]["seconds"] == [128 * 3 * 64 * k * 5 for k in (1, 2, 3)]
    assert (tmp_path / "scaling.png").read_bytes().startswith(b"\x89PNG")
