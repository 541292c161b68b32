"""A part that comes in variants."""

import datetime
from typing import Annotated, ClassVar

import pytest

from drone_rl.config.configuration import Variant, locate, variant_of
from drone_rl.config.learning import Returns
from drone_rl.config.networks import Lstm, Mlp, Network, OriginalCnn, SmallCnn
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole


class Day(Variant):
    target: ClassVar[str] = "datetime.timedelta"
    days: Annotated[int, Whole(0)] = 2


def test_a_variant_makes_what_it_stands_for():
    assert Day(days=3).make() == datetime.timedelta(days=3)
    assert Day().make(hours=1) == datetime.timedelta(days=2, hours=1)


def test_the_variants_of_a_part():
    ours = {variant for variant in Network.variants() if variant.__module__.startswith("drone_rl.")}
    assert ours == {SmallCnn, OriginalCnn, Lstm, Mlp}  # Other tests may have added their own.
    assert "_Discounted" not in {variant.__name__ for variant in Returns.variants()}
    ours = [v for v in Returns.variants() if v.__module__.startswith("drone_rl.")]
    assert len(ours) == 9
    assert SmallCnn().name == "small_cnn"


def test_what_is_made_is_imported_only_then():
    with pytest.raises(InputError, match=r"_target_=no\.such can't be imported"):
        locate("no.such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("os.no_such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("")
    assert locate("os.path").__name__ == "posixpath"


def test_an_unknown_name_without_a_module_is_refused():
    with pytest.raises(InputError, match=r"^network\._target_='resnet' is not registered"):
        variant_of(Network, {"_target_": "resnet"}, "network")


def test_a_registered_part_keeps_its_factory_with_values_of_the_users_own():
    import drone_rl.policies.networks  # noqa: F401 (connects the settings with their factories)

    part = variant_of(Network, {"_target_": "mlp", "hidden": [4], "more": 1}, "network")
    assert part.values() == {"hidden": [4], "more": 1}
    assert type(part).factory is Mlp.factory is not None
    other = variant_of(Network, {"_target_": "os.path.join", "more": 1}, "network")
    assert type(other).factory is None
