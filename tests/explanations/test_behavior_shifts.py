from pathlib import Path
from types import SimpleNamespace

import numpy as np

from drone_rl.explanations.behavior import shifts_section
from drone_rl.trust.shifts_file import SavedShifts


def test_what_was_measured_is_taken_over():
    strip = [np.full((5, 16, 3), 7, np.uint8), None, *[np.zeros((5, 16, 3), np.uint8)] * 4]
    measured = SavedShifts(Path("shifts.json"), {"axes": {"blur": {}}}, {"blur": strip})
    numbers, arrays = shifts_section(SimpleNamespace(measured=measured))
    assert numbers == {"shifts": {"axes": {"blur": {}}}}
    assert arrays["shifts_blur"].shape == (6, 5, 16, 3)
    assert arrays["shifts_blur"][0].min() == 7 and arrays["shifts_blur"][1].max() == 0


def test_why_it_is_refused_and_nothing_without():
    refused = SavedShifts(Path("shifts.json"), None, refused="it is of another task")
    assert shifts_section(SimpleNamespace(measured=refused)) == (
        {"shifts": {"refused": "it is of another task"}},
        {},
    )
    assert shifts_section(SimpleNamespace(measured=None)) == ({}, {})
