"""The bars of the plot show the figures."""

import matplotlib.figure
import pytest

from benchmarks.peers.plot import plot


def test_bars_are_means_and_dots_are_seeds(tmp_path, monkeypatch):
    kept = []
    save = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure, "savefig", lambda f, *a, **k: (kept.append(f), save(f, *a, **k))
    )
    ours = {"seconds": [9.0, 11.0], "seconds_without_imports": [5.0, 6.0], "is_solved": [True] * 2}
    theirs = {**ours, "seconds": [19.0, 21.0], "is_solved": [True, False]}
    plot({"ppo": ours, "sb3_ppo": theirs}, tmp_path / "peers.png")
    (axes,) = kept[0].axes
    widths = [bar.get_width() for bar in axes.patches]
    assert widths == pytest.approx([4.5, 5.5, 14.5, 5.5])
    assert [list(line.get_xdata()) for line in axes.lines] == [[9, 11], [19, 21], []]
    assert [text.get_text() for text in axes.texts] == ["  not all solved"]
    assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")
