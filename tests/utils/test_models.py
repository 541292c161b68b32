"""Errors of pydantic name the place, the value and the remedy."""

from typing import Annotated

import pydantic
import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model


class Wheel(Model):
    size: Annotated[int, pydantic.Field(ge=1, le=9)] = 3

    @pydantic.model_validator(mode="after")
    def check(self):
        if self.size == 7:
            raise InputError("size=7 does not roll; give 8")
        return self


class Car(Model):
    wheels: tuple[Wheel, ...] = ()
    spare: Wheel | None = None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"wheels": [{"size": 0}]}, r"wheels\[0\]\.size=0: .*greater than or equal to 1"),
        ({"wheel": 1}, "wheel is unknown; valid names: wheels, spare; did you mean wheels"),
        ({"spare": {"sise": 1}}, "spare.sise is unknown; valid names: size; did you mean size"),
        ({"spare": {"size": 7}}, "spare.size=7 does not roll; give 8"),
        ({"spare": Wheel(size=2), "wheels": 3}, "wheels=3: it must be a list"),
    ],
)
def test_errors_name_place_and_value(values, message):
    with pytest.raises(InputError, match=f"^{message}"):
        Car(**values)


def test_files_are_read_as_they_were_written_and_strictly(tmp_path):
    path = tmp_path / "car.json"
    car = Car(wheels=(Wheel(size=1), Wheel()), spare=Wheel(size=9))
    car.write_json(path)
    assert Car.read_json(path) == car
    path.write_text('{"spare": {"size": "2"}}')
    with pytest.raises(InputError, match=r"^spare.size='2': .*valid integer"):
        Car.read_json(path)
    path.write_text('{"spare": ')
    with pytest.raises(InputError, match="is damaged"):
        Car.read_json(path)
