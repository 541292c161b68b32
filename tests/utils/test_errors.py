from drone_rl.utils.errors import InputError


def test_a_users_mistake_is_a_value_error_with_its_message():
    error = InputError("seed=-1 is out of range; give 0 or more")
    assert isinstance(error, ValueError)
    assert str(error) == "seed=-1 is out of range; give 0 or more"
