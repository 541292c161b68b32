"""Episodes under other conditions as `shifts.json` has them, made up and not run."""

import dataclasses
from types import SimpleNamespace

import numpy as np

from drone_rl.config.commands import ShiftSettings
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes import AXES
from drone_rl.trust.domain import find_range
from drone_rl.trust.shifts_results import (
    AlongAxis,
    ConditionFigures,
    Domain,
    FailedEnd,
    Level,
    ModeFigures,
    NetworkIdentity,
    Plain,
    Probe,
    RangeTest,
    Robustness,
    packed,
)
from drone_rl.trust.suite import finite, success_area
from drone_rl.utils.intervals import proportion

EPISODES = 200


def flown(successes=EPISODES):
    figures = ModeFigures(success=proportion(successes, EPISODES))
    oracle = proportion(EPISODES, EPISODES)
    return ConditionFigures(oracle=oracle, impossible=False, modes={"constant": figures})


def along(axis, of, last):
    """Success up to one of an axis's strengths, none after it."""
    limit = abs(axis.position(last)) + 1e-12
    levels = tuple(
        Level(
            **dict(flown(EPISODES if abs(axis.position(s)) <= limit else 20)),
            number=i,
            value=axis.value(s, of),
            position=axis.position(s),
        )
        for i, s in enumerate(axis.strengths, 1)
    )
    return AlongAxis(
        group=axis.group,
        unit=axis.unit,
        neutral=finite(axis.value(axis.neutral, of)),
        areas={"constant": success_area(levels, 1.0, "constant")},
        levels=levels,
    )


def found_to(axis, of, last):
    """The range of an axis that is good as far as one of its strengths, and no farther."""
    limit = abs(axis.position(last)) + 1e-12

    def probe(strength):
        good = abs(axis.position(strength)) <= limit
        return Probe(good=good, bad=not good, success=1.0 if good else 0.5)

    def explain(end, strength, probed):
        return FailedEnd(**dict(probed), end=end, value=axis.value(strength, of))

    passed = RangeTest(success=proportion(EPISODES, EPISODES), required=0.9)
    return find_range(axis, of, probe, explain, lambda _: passed)


def owned(name, of):
    """An axis with the policy's own neutral strength."""
    axis = AXES[name]
    return axis if axis.own is None else dataclasses.replace(axis, neutral=axis.own(of))


def subject_of(policy):
    """What axes need of a policy."""
    camera = policy.description.camera
    return SimpleNamespace(task=policy.task, camera=camera, appearance=policy.appearance)


def shifts_of(policy, *, axes=("blur", "dead_rows"), weights=None):
    """Of a policy that is good up to the third strength of each axis."""
    of = subject_of(policy)
    black = packed(np.zeros((of.camera.height, of.camera.width, 3), np.uint8))
    third = {name: (owned(name, of), of, AXES[name].strengths[2]) for name in axes}
    return Robustness(
        policy=policy.name,
        network=NetworkIdentity(
            weights=weights or fingerprint(policy.state.weights),
            description=policy.description.model_dump(mode="json"),
        ),
        settings=ShiftSettings(seed=0),
        seed=0,
        terms=as_task(of.task).vocabulary,
        plain=Plain(success=proportion(EPISODES, EPISODES), oracle=proportion(EPISODES, EPISODES)),
        axes={name: along(*case) for name, case in third.items()},
        together=flown(),
        domain=Domain(
            plain=Probe(good=True, success=1.0),
            ranges={name: found_to(*case) for name, case in third.items()},
        ),
        pictures={name: (black,) * 6 for name in axes},
    )
