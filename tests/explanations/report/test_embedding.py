import numpy as np
import pytest
from PIL import Image

from drone_rl.explanations.report.embedding import (
    MAX_THUMBNAILS,
    PART,
    cells,
    points,
    shown_frames,
    sprite,
    table,
)


@pytest.fixture
def explanation(make_explanation):
    rng = np.random.default_rng(1)
    arrays = {f"tsne_{which}": rng.normal(size=(12, 2)) for which in ("features", "pixels")}
    return make_explanation(arrays=arrays)


def test_no_more_frames_are_shown_than_fit(make_explanation):
    assert shown_frames(make_explanation()).tolist() == list(range(12))
    many = shown_frames(make_explanation(frames=2 * MAX_THUMBNAILS + 1))
    assert (len(many), many[0], many[-1]) == (MAX_THUMBNAILS, 0, 2 * MAX_THUMBNAILS)
    assert set(np.diff(many)) == {2, 3} or set(np.diff(many)) == {2}


def test_each_frame_has_a_cell_of_its_own(explanation):
    placed = cells(explanation, "features")
    assert len({tuple(cell) for cell in placed.tolist()}) == 12
    assert placed.min() >= 0


def test_points_tell_the_page_of_each_frame(explanation):
    told = points(explanation)
    assert told["tile"] == [6, 4]
    assert told["step"] == [*range(6), *range(6)]
    assert told["last"] == [5, 5]
    assert told["event"][1:4] == ["", "collects a cube", ""]
    assert told["cells"]["pixels"] == cells(explanation, "pixels").tolist()
    assert np.allclose(np.sum(told["probabilities"], axis=1), 1, atol=2e-3)


def test_the_sprite_holds_each_frame_where_the_page_cuts_it(make_explanation):
    explanation = make_explanation(frames=32)
    explanation.data["frames"][:] = 0
    explanation.data["frames"][31] = 255
    sheet = sprite(explanation).convert("RGB")
    assert sheet.size == (30 * 6, 2 * 4)
    assert isinstance(sheet, Image.Image)
    assert sheet.getpixel((1 * 6 + 2, 4 + 1)) == (255, 255, 255)
    assert sheet.getpixel((2, 1)) == (0, 0, 0)


def test_the_table_has_both_places_of_each_frame(explanation):
    heading, *rows = table(explanation)
    assert heading[-4:] == ["x_features", "y_features", "x_pixels", "y_pixels"]
    assert rows[7][:4] == [7, 1, 1, "left"]
    assert rows[7][4:] == [
        round(float(x), 4) for which in ("features", "pixels")
        for x in explanation.arrays[f"tsne_{which}"][7]
    ]  # fmt: skip


def test_maps_are_drawn_and_all_that_the_page_needs_is_given(explanation):
    assert PART.draw(explanation).keys() == {"tsne_features", "tsne_pixels"}
    extras = PART.extras(explanation)
    assert extras["points"]["sprite"].startswith("data:image/png;base64,")
