"""Class models with settings of one's own."""

import json

import numpy as np
import pytest

import drone_rl
from drone_rl.explanations.class_model_gallery import GALLERY
from drone_rl.utils.errors import InputError


@pytest.fixture(scope="module")
def found():
    return drone_rl.class_models("good", steps=4, starts=2, episodes=2, seed=0)


def test_result_has_a_row_of_probabilities_for_the_given_settings(found):
    header, row = found.rows()
    assert header == ["settings", "left", "forward", "right"]
    assert row[0] == "given settings" and all(0 <= float(cell) <= 1 for cell in row[1:])
    assert "left" in str(found) and "seed 0" in str(found)
    assert "<img" in found._repr_html_()


def test_files(found, tmp_path):
    found.save(tmp_path)
    written = json.loads((tmp_path / "class_models.json").read_text())
    assert written["settings"]["given settings"]["steps"] == 4 and written["seed"] == 0
    with np.load(tmp_path / "class_models.npz") as arrays:
        assert arrays["images_0"].shape == (3, 2, 1, 25, 64)
    assert (tmp_path / "class_models.png").read_bytes().startswith(b"\x89PNG")


def test_gallery_shows_each_refinement():
    found = drone_rl.class_models("poor", gallery=True, episodes=2, seed=0)
    assert list(found.tried) == list(GALLERY)
    first, *_, last = found.tried.values()
    assert first.settings.maximize == "probability" and first.settings.blur == 0.0
    assert last.settings == drone_rl.ClassModelsSettings().as_base(type(last.settings))
    failed = "defaults: no image found makes forward or right more probable than not"
    assert failed in str(found) and failed in found._repr_html_()
    width, height = found.image().size
    assert height > len(GALLERY) * 25 and width > 3 * 64


def test_a_seed_may_be_longer_than_64_bits():
    found = drone_rl.class_models("good", steps=1, starts=1, episodes=1, seed=2**64)
    assert found.seed.value == 2**64


def test_images_that_diverge_are_an_error():
    with pytest.raises(InputError, match="lr=1e\\+09 the images diverge"):
        drone_rl.class_models(
            "good", step="plain", lr=1e9, clamp=False, normalize="none", l2=1.0, episodes=1, seed=0
        )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": 0}, "steps=0"),
        ({"lr": 0.0}, "lr=0"),
        ({"maximize": "logits"}, "did you mean logit"),
        ({"blur": -1.0}, "blur=-1"),
    ],
)
def test_invalid_settings(changes, message):
    with pytest.raises(InputError, match=message):
        drone_rl.class_models("good", **changes)
