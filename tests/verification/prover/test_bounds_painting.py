"""Bounds on images of one row of two pixels, by hand."""

import itertools

import torch

from drone_rl.verification.prover.bounds import Compositor
from drone_rl.verification.prover.cube_images import FRONT, LEFT_SIDE, NOTHING, RIGHT_SIDE

PAINTER = Compositor(torch.tensor([[0.5, 0.9]]), torch.tensor([0.3, 0.1, 0.7]))
ALL = (slice(0, 1), slice(0, 2))


def mask(*pixels):
    """One case; what each pixel may show."""
    bits = [sum(1 << face for face in faces) for faces in pixels]
    return torch.tensor([[bits]], dtype=torch.uint8)


def paint(*cubes):
    case = torch.tensor([0])
    lower, upper = PAINTER.paint([(ALL, cube, case) for cube in cubes], len(case))
    return lower[0, 0].tolist(), upper[0, 0].tolist()


def close(found, lower, upper):
    assert torch.allclose(torch.tensor(found[0]), torch.tensor(lower))
    assert torch.allclose(torch.tensor(found[1]), torch.tensor(upper))


def test_nothing_shows_the_background():
    close(paint(mask([NOTHING], [NOTHING])), [0.5, 0.9], [0.5, 0.9])
    lower, upper = PAINTER.paint([], 1)
    close((lower[0, 0].tolist(), upper[0, 0].tolist()), [0.5, 0.9], [0.5, 0.9])


def test_faces_have_their_shades():
    close(paint(mask([FRONT], [RIGHT_SIDE])), [0.3, 0.7], [0.3, 0.7])


def test_doubt_is_from_the_darkest_to_the_brightest():
    close(paint(mask([NOTHING, FRONT], [LEFT_SIDE, RIGHT_SIDE])), [0.3, 0.1], [0.5, 0.7])


def test_the_nearer_cube_covers_the_farther_one():
    near, far = mask([FRONT], [NOTHING, FRONT]), mask([LEFT_SIDE], [LEFT_SIDE])
    close(paint(near, far), [0.3, 0.1], [0.3, 0.3])


def test_bounds_hold_all_pictures_and_no_more():
    """Every mixture of what two cubes may show, painted one by one."""
    choices = [[NOTHING], [FRONT], [NOTHING, LEFT_SIDE], [FRONT, RIGHT_SIDE], [0, 1, 2, 3]]
    for near, far in itertools.product(choices, repeat=2):
        seen = []
        for one, other in itertools.product(near, far):
            faces = [torch.tensor([[[f, f]]], dtype=torch.uint8) for f in (one, other)]
            (image,) = PAINTER.paint_one([(ALL, f) for f in faces], 1)
            seen.append(image[0])
        lower, upper = paint(mask(near, near), mask(far, far))
        close(
            (lower, upper),
            torch.stack(seen).min(0).values.tolist(),
            torch.stack(seen).max(0).values.tolist(),
        )


def test_a_cube_is_seen_in_its_part_alone():
    part = (slice(0, 1), slice(1, 2))
    (image,) = PAINTER.paint_one([(part, torch.tensor([[[FRONT]]], dtype=torch.uint8))], 1)
    assert torch.allclose(image, torch.tensor([[0.5, 0.3]]))


def test_what_follows_is_applied():
    compositor = Compositor(torch.tensor([[0.5, 0.9]]), torch.zeros(3), lambda p: p[..., :1] * 2)
    assert compositor.see(torch.tensor([[[0.5, 0.9]]])).tolist() == [[[[1.0]]]]
