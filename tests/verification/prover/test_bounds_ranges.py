"""ImageRanges of images, by hand and against every image."""

import numpy as np
import torch

from drone_rl.verification.prover.bounds import ImageRanges


def test_what_may_be_seen_in_ranges():
    images = torch.tensor([[[0, 1]], [[2, 1]], [[0, 0]]], dtype=torch.uint8)
    ranges = ImageRanges(images)
    masks, case = ranges.of(np.array([[0, 0], [0, 2], [1, 2], [0, 2]]))
    found = masks[case][:, 0].tolist()
    assert found == [[1, 2], [5, 3], [5, 3], [5, 3]]
    assert ranges.doubts(np.array([[0, 0], [0, 1], [0, 2]])).tolist() == [0, 1, 2]


def test_every_range_of_many_pictures():
    images = torch.from_numpy(np.random.RandomState(0).randint(0, 4, (9, 2, 3)).astype(np.uint8))
    ranges = ImageRanges(images)
    every = np.array([(a, b) for a in range(9) for b in range(a, 9)])
    masks, case = ranges.of(every)
    for (a, b), mask, doubts in zip(every, masks[case], ranges.doubts(every), strict=True):
        shown = [{*pixel} for pixel in images[a : b + 1].flatten(1).T.tolist()]
        assert mask.flatten().tolist() == [sum(1 << face for face in faces) for faces in shown]
        assert doubts == sum(len(faces) > 1 for faces in shown)


def test_only_the_part_where_a_cube_is_ever_seen_is_kept():
    images = torch.zeros(3, 4, 5, dtype=torch.uint8)
    images[0, 1, 2] = images[2, 2, 4] = 1
    ranges = ImageRanges(images)
    assert ranges.part == (slice(1, 3), slice(2, 5))
    assert ranges.images.shape == (3, 2, 3)
    assert ImageRanges(torch.zeros_like(images)).part == (slice(0, 0), slice(0, 0))
