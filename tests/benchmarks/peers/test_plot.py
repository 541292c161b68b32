"""The plot has a line for each seed of each learner."""

import matplotlib.figure

from benchmarks.peers.plot import COLORS, plot


def test_lines_are_seeds_and_end_in_dots(tmp_path, monkeypatch):
    kept = []
    save = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure, "savefig", lambda f, *a, **k: (kept.append(f), save(f, *a, **k))
    )
    ours = [[(3.0, 0.5), (5.0, 2.97)], [(3.5, 0.4), (6.0, 2.98)]]
    plot({"ppo": ours, "sb3_ppo": [[(4.0, 0.3), (9.0, 1.5)]]}, tmp_path / "peers.png")
    (axes,) = kept[0].axes
    lines = [(line.get_linestyle(), [*map(float, line.get_xdata())]) for line in axes.lines[1:]]
    assert lines == [
        *(("-", [3.0, 5.0]), ("None", [5.0]), ("-", [3.5, 6.0]), ("None", [6.0])),
        *(("--", [4.0, 9.0]), ("None", [9.0])),
    ]
    assert [float(line.get_ydata()[-1]) for line in axes.lines[1::2]] == [2.97, 2.98, 1.5]
    labels = [line.get_label() for line in axes.lines if not line.get_label().startswith("_")]
    assert labels == ["drone_rl, PPO", "Stable-Baselines3, PPO"]
    assert len(set(COLORS.values())) == len(COLORS)
    assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")
