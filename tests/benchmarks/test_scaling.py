import pytest

from benchmarks import scaling
from benchmarks.scaling import bench_scaling


def test_a_straight_line_explains_everything_and_a_bend_does_not():
    assert scaling._r_squared({1: 3.0, 2: 5.0, 4: 9.0}) == pytest.approx(1.0)
    # by hand: the line through 0, 0, 3 at 0, 1, 2 misses by 1.5 of a variance of 6
    assert scaling._r_squared({0: 0.0, 1: 0.0, 2: 3.0}) == pytest.approx(1 - 1.5 / 6)


def test_times_are_taken_by_worlds_frames_cubes_and_pixels(monkeypatch, tmp_path):
    def make_worlds(n, device, cubes=3, camera=None):
        return n, cubes * (camera.width if camera else 1)

    monkeypatch.setattr(scaling, "make_worlds", make_worlds)
    monkeypatch.setattr(scaling, "_seconds", lambda worlds, steps, _: worlds[0] * worlds[1] * steps)
    found = bench_scaling(tmp_path, "cpu", quick=True)["scaling"]
    assert found["worlds"]["sizes"] == [32, 64, 128]
    assert found["worlds"]["seconds"] == [480, 960, 1920]
    assert found["frames"]["sizes"] == [320, 640, 960]
    assert found["frames"]["r_squared"] == pytest.approx(1.0)
    assert found["cubes"]["sizes"] == [1, 4, 8]
    assert found["pixels"]["sizes"] == [1600, 6400, 14400]
    assert found["pixels"]["seconds"] == [128 * 3 * 64 * k * 5 for k in (1, 2, 3)]
    assert (tmp_path / "scaling.png").read_bytes().startswith(b"\x89PNG")
