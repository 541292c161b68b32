"""The benchmark of the chapter's program, in a short version against servers in threads."""

import contextlib

from benchmarks import airsim_chapter
from drone_rl.flight.airsim.serving import serve


def test_the_oracle_collects_all_cubes_in_each_mode_and_a_training_is_judged(tmp_path, monkeypatch):
    clocks = []

    @contextlib.contextmanager
    def served(folder, clock, *, settings):
        clocks.append(clock)
        folder.mkdir(parents=True)
        (folder / "settings.json").write_text(settings)
        clock = clock.removeprefix("clock=")
        with serve(folder / "settings.json", clock=clock, port=0) as server:
            yield server.address[1], 0, 0.0

    monkeypatch.setattr(airsim_chapter, "served", served)
    found = airsim_chapter.bench_airsim_chapter(tmp_path, quick=True)
    assert found["airsim_chapter_cubes"] == [3.0, 3.0, 3.0]
    assert 0.0 <= found["airsim_chapter_lower95"] < 0.9  # after one update
    assert found["airsim_chapter_minutes"] > 0.0
    assert clocks == ["clock=wall", "clock=lockstep", "clock=wall", "clock=lockstep"]
