import base64
import io

import imageio.v3 as iio
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from drone_rl.trust.plots.saving import new_chart, save_drawn, to_uri


def content(uri, kind):
    head, _, text = uri.partition(",")
    assert head == f"data:{kind};base64"
    return base64.b64decode(text)


def test_a_picture_is_a_png_and_a_uri_of_the_same_pixels(tmp_path):
    picture = Image.new("RGB", (3, 2), (10, 20, 30))
    saved = content(save_drawn(picture, tmp_path / "0_a.b"), "image/png")
    assert (tmp_path / "0_a.b.png").read_bytes() == saved
    with Image.open(io.BytesIO(saved)) as read:
        assert (read.size, read.getpixel((2, 1))) == ((3, 2), (10, 20, 30))


def test_a_chart_is_a_png_of_90_dots_an_inch_and_an_svg_of_the_same_bytes_each_time(tmp_path):
    saved = [content(save_drawn(Figure((2, 1)), tmp_path / "c"), "image/svg+xml") for _ in "ab"]
    assert saved[0] == saved[1] == (tmp_path / "c.svg").read_bytes()
    assert b'width="144pt" height="72pt"' in saved[0]
    with Image.open(tmp_path / "c.png") as p:
        assert p.size == (180, 90)


def test_a_chart_of_one_panel():
    figure, axis = new_chart(height=2.0)
    assert figure.axes == [axis] and figure.get_size_inches().tolist() == [4.5, 2.0]


def test_a_film_is_an_mp4_with_all_frames(tmp_path):
    film = np.zeros((5, 16, 32, 3), np.uint8)
    film[3:] = 200
    assert (
        content(save_drawn(film, tmp_path / "f"), "video/mp4") == (tmp_path / "f.mp4").read_bytes()
    )
    read = iio.imread(tmp_path / "f.mp4")
    assert read.shape == film.shape
    assert read[0].mean() < 20 and read[4].mean() > 180


def test_a_uri():
    assert to_uri(b"abc", "text/plain") == "data:text/plain;base64,YWJj"
