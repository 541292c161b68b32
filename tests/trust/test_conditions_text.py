"""Other conditions than in training are named as one types them."""

from drone_rl.trust.conditions_text import unlike


def test_settings_are_named_as_they_are_typed():
    mode = {"own": "computer_vision", "flown": "simple_flight"}
    wind = {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.5]}
    assert unlike({"unlike": {"mode": mode, "wind": wind}}) == (
        "It was trained with other dynamics: here it flew with dynamics.mode=simple_flight "
        "instead of computer_vision and dynamics.wind=[5, 0, 0.5] instead of [0, 0, 0]."
    )
    zenith = {"own": None, "flown": [0.2, 0.24, 0.42]}
    named = unlike({"unlike": {"appearance.sky_zenith": zenith, "is_x": {"own": 1, "flown": True}}})
    assert "appearance.sky_zenith=[0.2, 0.24, 0.42] instead of null" in named
    assert "with other dynamics and another appearance: " in named and "=true instead of 1" in named


def test_numbers_that_differ_are_not_rounded_to_the_same():
    mass = {"own": 1.0, "flown": 1.00000012}
    assert "dynamics.mass=1.00000012 instead of 1." in unlike({"unlike": {"mass": mass}})


def test_of_many_settings_three_are_named():
    changed = {f"appearance.s{i}": {"own": 0, "flown": 1} for i in range(4)}
    assert "appearance.s3=1 instead of 0." in unlike({"unlike": changed})
    changed["appearance.s4"] = {"own": 0, "flown": 1}
    text = unlike({"unlike": changed})
    assert text.endswith("appearance.s2=1 instead of 0 and 2 other changed settings.")
    assert "s3" not in text
