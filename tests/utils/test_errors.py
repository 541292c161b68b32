from drone_rl.utils.errors import InputError, did_you_mean


def test_a_users_mistake_is_a_value_error_with_its_message():
    error = InputError("seed=-1 is out of range; give 0 or more")
    assert isinstance(error, ValueError)
    assert str(error) == "seed=-1 is out of range; give 0 or more"


def test_the_known_name_that_is_most_like_an_unknown_one():
    assert did_you_mean("GOOD", ["good", "proved"]) == "; did you mean good?"
    assert did_you_mean("grid_snaped", ["rgb", "Grid_Snapped"]) == "; did you mean Grid_Snapped?"
    assert did_you_mean("x", ["good", "proved"]) == ""
    assert did_you_mean("fov", ["width", "horizontal_fov"]) == "; did you mean horizontal_fov?"
    assert did_you_mean("fov", ["vertical_fov", "horizontal_fov"]) == ""
