"""Parts of the user's own: their settings come from their signatures."""

from typing import Annotated, Literal

import pytest
import torch

from drone_rl.config.learning import Collector, Objective, Returns
from drone_rl.config.networks import Network, SmallCnn
from drone_rl.config.registry import (
    modules_of,
    own_place,
    register_collector,
    register_learner,
    register_network,
    register_returns,
    register_transform,
)
from drone_rl.config.training import TrainSettings
from drone_rl.envs.transforms import PixelTransform
from drone_rl.objectives import ReturnEstimator
from drone_rl.policies import MLP
from drone_rl.policies.zoo import PolicyDescription, describe
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole


class Wide(MLP):
    """A wide network.

    More about it.
    """

    def __init__(
        self,
        in_shape,
        num_actions,
        *,
        width: Annotated[int, Whole(1, 64)] = 8,
        mode: Literal["slow", "fast"] = "fast",
        sizes: tuple[int, ...] = (1, 2),
        rate: float | None = None,
        generator: torch.Generator | None = None,
    ):
        self.told = (width, mode, tuple(sizes), rate)
        super().__init__(in_shape, num_actions, hidden=(width,), generator=generator)


class Mirror(PixelTransform):
    def _apply_transform(self, obs):
        return obs.flip(-1)[..., ::2]


def test_the_settings_of_a_network_are_those_of_its_signature(registered):
    settings = registered(register_network("wide")(Wide)).Settings
    assert settings.__doc__ == "A wide network."
    assert settings().values() == {"width": 8, "mode": "fast", "sizes": [1, 2], "rate": None}
    assert settings(width=9).make((1, 2, 2), 3, generator=None).told == (9, "fast", (1, 2), None)
    for wrong in ({"width": 65}, {"mode": "no"}, {"sizes": (1.5,)}, {"rate": "x"}):
        with pytest.raises(InputError, match=next(iter(wrong))):
            settings(**wrong)


@pytest.mark.parametrize("hint", [torch.Tensor, tuple[torch.Tensor, ...], object()])
def test_types_that_are_no_settings_are_refused(hint):
    def build(in_shape, num_actions, *, size=1, generator=None): ...

    build.__annotations__["size"] = hint
    with pytest.raises(InputError, match="the parameter size is of type"):
        register_network("odd")(build)


def test_a_network_is_selected_by_name_and_described_by_name_and_values(registered):
    registered(register_network("wide")(Wide))
    training = TrainSettings(network="wide")
    assert training == TrainSettings.read(training.config())
    assert training.config()["network"]["_target_"] == "wide"
    described = describe(training)
    plain = described.model_dump(mode="json")
    assert plain["network"]["name"] == "wide"
    assert PolicyDescription.read(plain) == described
    assert described.build_network().told == (8, "fast", (1, 2), None)


def test_a_transform_is_selected_by_its_key_and_measured_by_a_call(registered):
    registered(register_transform("mirror")(Mirror))
    training = TrainSettings.read(
        {"transforms": {"gray": {}, "mirror": {}, "standardize": {"mean": 0.5}}}
    )
    assert [step.name for step in training.transforms] == ["gray", "mirror", "standardize"]
    assert describe(training).shapes == {"pixels": (1, 25, 32)}


def test_a_return_estimator(registered):
    class Twice(ReturnEstimator):
        def __init__(self, factor: float = 2.0, **kwargs):
            super().__init__(**kwargs)
            self.factor = factor

        def estimate(self, reward, done):
            return self.factor * reward

    settings = registered(register_returns("twice")(Twice)).Settings
    assert settings(factor=3, scale=True).make().factor == 3.0
    assert settings(scale=True).make().scale is True
    assert Returns.read("twice") == settings()


def test_a_learner_and_a_collector_get_the_settings_of_the_training(registered):
    class Parts(tuple):
        in_keys = update = state_dict = check_state = load_state_dict = None
        collector = network = generators = None

    @register_learner("mine")
    def learner(settings, parts, *, alpha: float = 0.5):
        return Parts((settings, parts, alpha))

    @register_collector("theirs")
    def collector(settings, replay, *, patience: int = 3):
        return Parts((settings, replay, patience))

    registered(learner), registered(collector)
    training = TrainSettings(
        objective=Objective.read({"name": "mine", "alpha": 0.1}),
        collector=Collector.read({"name": "theirs", "num_envs": 5}),
    )
    assert training.objective.make(training, "made") == (training, "made", 0.1)
    assert training.collector.make(training, None) == (training, None, 3)


def test_a_name_that_is_not_registered():
    with pytest.raises(InputError, match=r"network='x': it must be one of .*small_cnn.*plugins="):
        TrainSettings(network="x")


@pytest.mark.parametrize("name", ["small_cnn", "No", "a-b", ""])
def test_names_that_cannot_be_registered(name):
    with pytest.raises(InputError, match=r"is built in|is invalid"):
        register_network(name)(Wide)


def test_a_decorator_without_a_name_is_refused():
    with pytest.raises(InputError, match="give a name in brackets, as in "):
        register_network(Wide)


@pytest.mark.parametrize(
    ("register", "missing"),
    [
        (register_network, "in_shape; return a PolicyNetwork"),
        (register_transform, "_apply_transform, _parameters; return a Transform"),
        (register_returns, "estimate, _parameters; return a ReturnEstimator"),
        (register_learner, ".*, load_state_dict; return a Learner"),
        (register_collector, "collector, network, generators; return a Components"),
    ],
)
def test_a_factory_that_returns_none_is_named(registered, register, missing):
    def build(*args, **kwargs):
        return None

    settings = registered(register("mine")(build)).Settings
    with pytest.raises(InputError, match=rf"=mine: .*build of {__file__} makes None .*{missing}$"):
        settings().make()


def test_a_class_that_does_not_initialize_its_base_is_named(registered):
    class Careless(MLP):
        def __init__(self, in_shape, num_actions, *, generator=None):
            self.shape = in_shape

    settings = registered(register_network("mine")(Careless)).Settings
    with pytest.raises(InputError, match=r"Careless of .* without in_shape; call super\(\)\."):
        settings().make((1, 2, 2), 3)


def test_an_error_of_a_factory_is_reported_with_its_line(registered):
    @register_learner("mine")
    def learner(settings, parts):
        return {}[settings]

    settings = registered(learner).Settings
    with pytest.raises(InputError, match=rf"^objective=mine failed in line \d+ of {__file__} \(K"):
        settings().make("key", None)


def test_the_place_of_a_part_of_ones_own(registered):
    assert own_place(SmallCnn()) == ""
    assert own_place(registered(register_network("wide")(Wide)).Settings()) == f"Wide of {__file__}"


def test_a_module_that_is_imported_again_replaces_its_parts(registered):
    first = register_network("wide")(Wide).Settings
    second = registered(register_network("wide")(Wide)).Settings
    assert first is not second
    assert Network.registry["wide"] is second


def test_parameters_without_a_default_or_of_another_type_are_refused():
    def no_default(in_shape, num_actions, *, width: int):
        return None

    def no_type(in_shape, num_actions, *, width=3):
        return None

    def another(in_shape, num_actions, *, width: torch.Tensor = None):
        return None

    for factory in (no_default, no_type):
        with pytest.raises(InputError, match="width needs a type and a default"):
            register_network("odd")(factory)
    with pytest.raises(InputError, match="width is of type"):
        register_network("odd")(another)


@pytest.mark.parametrize("name", ["values", "make", "name", "target"])
def test_a_parameter_with_the_name_of_an_attribute_of_settings_is_refused(name):
    scope = {}
    exec(f"def learner(settings, collecting, *, {name}: int = 1): ...", scope)
    with pytest.raises(
        InputError, match=f"mine: the parameter {name} has the name of an attribute"
    ):
        register_learner("mine")(scope["learner"])


def test_the_modules_of_registered_parts(registered):
    assert modules_of(TrainSettings()) == set()
    registered(register_network("wide")(Wide))
    assert modules_of(TrainSettings(network="wide")) == {__name__}
    registered(register_transform("mirror")(Mirror))
    mirrored = TrainSettings.read({"transforms": {"gray": {}, "mirror": {}}})
    assert modules_of(mirrored) == {__name__}


def test_two_modules_cannot_register_one_name(registered):
    def make(in_shape, num_actions):
        return Wide(in_shape, num_actions)

    register_network("twice")(make)
    register_network("twice")(make)  # as when a module is imported again
    make.__module__ = "another"
    with pytest.raises(InputError, match=r"^network=twice is registered by tests.*; give another"):
        register_network("twice")(make)
    make.__module__ = "__main__"  # as in a script that is also a plugin
    registered(register_network("twice")(make))
