"""Hand-computed images with visual effects, for both launchers."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.rendering import Appearance, Texture
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import to_gray
from tests.from_above import LAUNCHERS, SIZE, render, tracer

EVEN = {"ambient": (1.0, 1.0, 1.0), "sun": (0.0, 0.0, 0.0)}


WHITE = {SemanticClass.GROUND: (1.0, 1.0, 1.0)}


@pytest.fixture(scope="module", params=LAUNCHERS)
def renderer(request):
    renderer = tracer(request.param)
    yield renderer
    renderer.close()


@pytest.mark.parametrize("modality", ["rgb", "depth", "distance", "segmentation", "normals"])
@pytest.mark.parametrize("camera", ["down", "ahead"])
def test_effects_of_zero_strength_change_nothing(renderer, camera, modality):
    nothing = Appearance(zenith=(0.2, 0.4, 0.6), fog_visibility=math.inf)
    plain, drawn = (render(renderer, a, camera=camera, modality=modality) for a in (None, nothing))
    assert (plain.double() - drawn.double()).abs().max() <= (1 if modality == "rgb" else 0)


def test_sky_blends_from_horizon_to_zenith(renderer):
    image = render(renderer, Appearance(zenith=(1.0, 0.4, 0.0)), camera="ahead")[0].double()
    slopes = 1 - (torch.arange(SIZE // 2) + 0.5) / (SIZE // 2)  # of the rows of the upper half
    column = -1 + 0.5 / 20  # of the first column
    heights = slopes / (1 + column**2 + slopes**2).sqrt()
    assert (image[:20, 0, 0] - (51 + heights * 204)).abs().max() <= 1
    assert (image[:20, 0, 1] == 102).all()
    assert (image[:20, 0, 2] - (153 - heights * 153)).abs().max() <= 1


@pytest.mark.parametrize("visibility", [10.0, 20.0])
def test_fog_leaves_5_percent_of_the_contrast_at_its_visibility(renderer, visibility):
    colors = {**WHITE, SemanticClass.SKY: (0.0, 0.2, 0.4)}
    image = render(renderer, Appearance(colors=colors, fog_visibility=visibility, **EVEN))[
        0
    ].double()
    aside = (2.5 + 0.125) / 10  # of the tested pixel, relative to its depth
    clear = 0.05 ** (10 * math.sqrt(1 + aside**2 + 0.0125**2) / visibility)
    wanted = [clear * 255 + (1 - clear) * sky for sky in (0, 51, 102)]
    assert image[20, 30].tolist() == pytest.approx(wanted, abs=1)
    plain = render(renderer, None, modality="depth")
    foggy = render(renderer, Appearance(fog_visibility=visibility), modality="depth")
    assert torch.equal(plain, foggy)


def test_box_casts_a_shadow(renderer):
    """The sun is at 45 degrees, so the shadow is 1 m long: four by four pixels."""
    plain, shaded = (render(renderer, Appearance(shadows=on))[0] for on in (0, 1))
    rows, columns = np.nonzero((plain != shaded).any(-1).numpy())
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (18, 21, 22, 25)
    assert len(rows) == 16
    assert shaded[20, 23].tolist() == [102, 51, 0]  # 0.4 of its color
    sunny = 0.4 + 0.6 * math.sqrt(0.5)
    assert plain[20, 23].tolist() == [int(255 * sunny), int(127.5 * sunny), 0]


@pytest.mark.parametrize(
    "kind, size", [("sphere", ".5"), ("cylinder", ".5 .5"), ("ellipsoid", ".5 .5 .5")]
)
def test_round_geoms_cast_shadows(kind, size):
    images = []
    for launcher in LAUNCHERS:
        renderer = tracer(launcher, kind, size)
        plain, shaded = (render(renderer, Appearance(shadows=on))[0] for on in (0, 1))
        dark = (plain != shaded).any(-1)
        assert 8 <= dark.sum() <= 16 and dark[19:21, 23:25].all()
        images.append(shaded)
        renderer.close()
    assert torch.equal(*images)


def test_texture_repeats_at_its_size(renderer):
    """Tiles are 2.5 m, ten pixels: five light and five dark ones."""
    tiled = {SemanticClass.GROUND: Texture(images=("checker",), size=2.5)}
    image = render(renderer, Appearance(colors=WHITE, textures=tiled, **EVEN))[0, ..., 0]
    row = image[2, 20:].tolist()
    inner = [row[i] for i in (1, 2, 3, 6, 7, 8)]
    assert inner in ([255] * 3 + [140] * 3, [140] * 3 + [255] * 3)
    assert torch.equal(image[:10, 20:30], image[:10, 30:])
    assert torch.equal(image[:10, 20:30], image[30:, 20:30])
    assert (image[2, 1] == image[7, 6]) and (image[2, 1] != image[7, 1])


def test_distant_texture_is_its_mean(renderer):
    tiled = {SemanticClass.GROUND: Texture(images=("checker",), size=0.02)}
    colors = {SemanticClass.GROUND: (1.0, 0.5, 0.0)}
    image = render(renderer, Appearance(colors=colors, textures=tiled, **EVEN))[0].double()
    mean = (255 + 140) / 2
    assert (image[:10] - torch.tensor([mean, mean / 2, 0.0])).abs().max() <= 1


def test_each_environment_has_its_own_appearance(renderer):
    appearance = Appearance(
        fog_visibility=torch.tensor([math.inf, 20.0, math.inf]),
        shadows=torch.tensor([0, 0, 1]),
        textures={
            SemanticClass.GROUND: Texture(
                images=("grid", "bricks"),
                size=torch.tensor([1.0, 2.0, 3.0]),
                choice=torch.tensor([-1, 0, 1]),
            )
        },
    )
    together = render(renderer, appearance, worlds=3)
    for world in range(3):
        alone = render(renderer, appearance[world : world + 1])
        assert torch.equal(together[world], alone[0])
    assert torch.equal(together[0], render(renderer, Appearance(zenith=(0.2, 0.4, 0.6)))[0])


def test_gray_equals_the_luma_of_rgb(renderer):
    appearance = Appearance(
        fog_visibility=30.0,
        shadows=1,
        textures={SemanticClass.TARGET: Texture(images=("noise",), size=1.0)},
    )
    rgb, gray = (render(renderer, appearance, modality=of) for of in ("rgb", "gray"))
    assert torch.equal(gray, to_gray(rgb))


def test_exposure_scales_colors_up_to_white(renderer):
    plain = render(renderer, Appearance(**EVEN))[0, 0, 0].tolist()
    assert plain == [255, 127, 0]
    assert render(renderer, Appearance(exposure=0.5, **EVEN))[0, 0, 0].tolist() == [127, 63, 0]
    assert render(renderer, Appearance(exposure=1.5, **EVEN))[0, 0, 0].tolist() == [255, 191, 0]
    sky = render(renderer, Appearance(exposure=2.0), camera="ahead")[0, 0, 0].tolist()
    assert sky == [102, 204, 255]
