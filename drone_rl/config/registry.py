"""Registry of parts: networks, transforms, return estimators, learners and collectors.

A user's module registers a part with a decorator, `drone-rl train plugins=[my_module]` imports the
module, and `network=my_name` selects the part. The part's settings are the parameters of its
signature, with their types and defaults. Policy files contain only the registered name and values.

    @drone_rl.register_network("cells")
    class CellNetwork(PolicyNetwork):
        def __init__(self, in_shape, num_actions, *, rows: int = 5, generator=None): ...

Built-in parts have settings classes in this package, and `implements` connects them with the
classes and functions in higher layers.
"""

import functools
import inspect
import typing
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any, NamedTuple, TypeVar, cast

import pydantic

from drone_rl.config.learning import Collector, Objective, Returns
from drone_rl.config.networks import Network
from drone_rl.config.parts import Part
from drone_rl.config.transforms import Frame, Transform
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import check_name, described, errors_of, place_of, require_own
from drone_rl.utils.settings import Settings

F = TypeVar("F", bound=Callable[..., Any])


class _Base(NamedTuple):
    """Base class, or protocol, of one kind of part."""

    name: str
    members: tuple[str, ...]
    """Attributes of its objects."""


_BASES: dict[type[Part], _Base] = {
    Network: _Base("PolicyNetwork", ("in_shape",)),
    Transform: _Base("Transform", ("_apply_transform", "_parameters")),
    Returns: _Base("ReturnEstimator", ("estimate", "_parameters")),
    Objective: _Base(
        "Learner", ("in_keys", "update", "state_dict", "check_state", "load_state_dict")
    ),
    Collector: _Base("Components", ("collector", "network", "generators")),
}
_KEYS = {"in_keys", "out_keys"}


def implements(*variants: type[Part]) -> Callable[[F], F]:
    """Decorate a class or function as the factory of built-in variants."""

    def connect(factory: F) -> F:
        for variant in variants:
            variant.factory = staticmethod(factory)
        vars_of: Any = factory
        if isinstance(vars_of, type):
            setattr(vars_of, "Settings", variants[0])  # noqa: B010
        return factory

    return connect


def register_network(name: str) -> Callable[[F], F]:
    """Decorate a network class to register it under a name for settings and policy files.

    The class is called as `cls(in_shape, num_actions, *, generator, **settings)` and must derive
    from `drone_rl.policies.PolicyNetwork`. Its settings class is `cls.Settings`.

    Raises:
        InputError: The name is invalid or taken, or a parameter has no default or no plain type.
    """
    return _decorator(Network, name, 2, {"generator"})


def register_transform(
    name: str, *, output: Callable[[Frame, Any], Frame] | None = None
) -> Callable[[F], F]:
    """Decorate a class derived from TorchRL's `Transform` to register it as an image transform.

    Its `_apply_transform` is called with each batch of images, whose result must depend on these
    and the settings only: policy files and checkpoints save no buffers of transforms. What
    remembers something of each environment derives from `drone_rl.envs.CameraFault`.

    `output` maps the input's `Frame` and the settings to the output's `Frame`. By default, the
    shape is that of two transformed images. See `register_network` for errors.
    """
    methods = {"output": lambda self, frame: output(frame, self) if output else None}
    return _decorator(Transform, name, 0, _KEYS, methods)


def register_returns(name: str) -> Callable[[F], F]:
    """Decorate a class derived from `ReturnEstimator` to register it as a return estimator.

    The class accepts `scale`, for example by passing keyword arguments on to `ReturnEstimator`. See
    `register_network` for errors.
    """
    return _decorator(Returns, name, 0, {"reward_key", "done_key", "out_key"})


def register_learner(name: str) -> Callable[[F], F]:
    """Decorate a class or function to register it as a learner, selected by `objective=NAME`.

    It is called as `factory(settings, components, **own)`, with the settings of the training run
    and the result of `drone_rl.training.train.make_collector`, and returns a
    `drone_rl.training.learners.Learner`. See `register_network` for errors.
    """
    return _decorator(Objective, name, 2)


def register_collector(name: str) -> Callable[[F], F]:
    """Decorate a class or function to register it as a collector.

    It is called as `factory(settings, replay, **own)`, with the settings of the training run and
    the task that replays failures (None for the task of the settings), and returns a
    `drone_rl.training.train.Components`. See `register_network` for errors.
    """
    return _decorator(Collector, name, 2)


def own_place(part: Part) -> str:
    """Return the name and file of a part of the user's own, for messages; "" if it is built in."""
    if type(part).__module__.startswith("drone_rl."):
        return ""
    factory: Any = type(part).factory
    return place_of(inspect.unwrap(factory))


def modules_of(settings: Any) -> set[str]:
    """Return the modules that define the user's parts and tasks among settings.

    Other processes must import them before they read the settings' configuration.
    """
    if isinstance(settings, tuple):
        return set[str]().union(*map(modules_of, settings))
    if not isinstance(settings, Settings):
        return set()
    module = type(settings).__module__
    values = tuple(dict(settings).values())
    return modules_of(values) | ({module} if not module.startswith("drone_rl.") else set())


def _decorator(
    part: type[Part],
    name: Any,
    positional: int,
    skipped: Set[str] = frozenset(),
    methods: Mapping[str, Any] | None = None,
) -> Callable[[F], F]:
    """Return a decorator that creates the settings class of a part and connects it with the part.

    `positional` are the number of arguments of the factory that are no settings, `skipped` the
    names of further ones, and `methods` those of the settings class.
    """
    kind = part.__name__.lower()
    check_name(name, "register_network")

    def register(factory: F) -> F:
        taken = part.registry.get(name)
        if taken is not None:
            require_own(f"{kind}={name}", taken.__module__, factory.__module__)
        fields = _fields(name, factory, positional, skipped)
        taken = {*dir(part), "target"} - part.model_fields.keys()
        for field, _, _ in fields:
            if field in taken:
                raise InputError(
                    f"{name}: the parameter {field} has the name of an attribute of settings; "
                    "rename it"
                )
        inherited = part.model_fields.keys() if part is Returns else set()
        names = {*(field for field, _, _ in fields), *inherited}
        namespace = {
            **{field: default for field, _, default in fields},
            **(methods or {}),
            "__annotations__": {field: hint for field, hint, _ in fields},
            "__doc__": (inspect.getdoc(factory) or name).split("\n")[0],
            "__module__": factory.__module__,
            "target": name,
            "factory": staticmethod(_checked(factory, f"{kind}={name}", _BASES[part])),
            "arguments": lambda self: {n: v for n, v in self.values().items() if n in names},
        }
        cast(Any, factory).Settings = type(name.title().replace("_", ""), (part,), namespace)
        return factory

    return register


def _checked(factory: Callable[..., Any], what: str, base: _Base) -> Callable[..., Any]:
    """Return the factory with its errors, and an object that is no such part, as `InputError`."""

    @functools.wraps(factory, updated=())
    def make(*args: Any, **kwargs: Any) -> Any:
        with errors_of(what, place_of(factory)):
            made = factory(*args, **kwargs)
        if missing := [name for name in base.members if not hasattr(made, name)]:
            remedy = f"return a {base.name}"
            if isinstance(factory, type):
                remedy = "call super().__init__(...) first, or define what is missing"
            raise InputError(
                f"{what}: {place_of(factory)} makes {described(made)} without "
                f"{', '.join(missing)}; {remedy}"
            )
        return made

    return make


def _fields(
    name: str, factory: Callable[..., Any], positional: int, skipped: Set[str]
) -> list[tuple[str, Any, Any]]:
    """Return name, annotation and default of each setting, from a signature."""
    source: Any = factory.__init__ if isinstance(factory, type) else factory
    hints = typing.get_type_hints(source, include_extras=True)
    every = list(inspect.signature(factory).parameters.values())
    plain = [p for p in every if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    parameters = [p for p in every if p not in plain[:positional]]
    fields = []
    for parameter in parameters:
        is_star = parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
        if is_star or parameter.name in skipped:
            continue
        if parameter.default is parameter.empty or parameter.name not in hints:
            raise InputError(
                f"{name}: the parameter {parameter.name} needs a type and a default, as in "
                f"{parameter.name}: int = 1"
            )
        hint = _annotated(hints[parameter.name], f"{name}: the parameter {parameter.name}")
        default = parameter.default
        fields.append((parameter.name, hint, tuple(default) if type(default) is list else default))
    return fields


def _annotated(hint: Any, where: str) -> Any:
    """Return the type of a parameter as that of a setting: lists and sequences are tuples."""
    if typing.get_origin(hint) in (list, Sequence):
        hint = tuple[typing.get_args(hint)[0], ...]
    try:
        pydantic.TypeAdapter(hint).json_schema()  # plain data have one
    except pydantic.PydanticUserError as error:
        raise InputError(
            f"{where} is of type {hint}; give int, float, bool, str, a tuple of one of these, "
            "Literal, or Annotated with a kind of drone_rl.utils.schema"
        ) from error
    return hint
