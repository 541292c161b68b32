"""Malicious certificates and robustness measurements: wrong sizes, types or numbers."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.hostile_case import Case

Data = dict[str, Any]
_EDGE = 6.0
"""Largest lateral distance of cubes, metres."""


def hostile_claims(folder: Path, description: Data) -> list[Case]:
    """Write the files and return their cases.

    Args:
        folder: Folder of the files.
        description: Description of a policy for one cube.
    """
    cases = []
    for name, change in _certificates().items():
        data = _certificate(description)
        change(data)
        path = folder / f"stated_{name}.json"
        path.write_text(json.dumps(data))
        command = "check" if len(cases) % 2 else "verdict"
        arguments = [command, "policy=good", f"certificate={path}"]
        cases.append((path.name, arguments, "an invalid certificate"))
    for name, change in _shifts().items():
        data = _measured(description)
        change(data)
        path = folder / f"measured_{name}.json"
        path.write_text(json.dumps(data))
        arguments = ["verdict", "policy=good", f"shifts={path}"]
        cases.append((path.name, arguments, "invalid measurements"))
    return cases


def _certificate(description: Data) -> Data:
    outcome = {"end": "all_cubes", "collected": [True], "loops": False, "share": 1.0}
    outcome |= {"steps": {"14": 1.0}, "boxes": [[[-_EDGE, _EDGE]]]}
    return {
        "format": "drone_rl certificate",
        "format_version": 1,
        "policy": {
            "name": "good",
            "weights": "0" * 64,
            "description": copy.deepcopy(description),
        },
        "outcomes": [outcome],
        "undecided": {"share": 0.0, "boxes": []},
        "finished": True,
        "stated": {"logit_gap": 1e-4, "largest_band": 1e-5, "renderer": "Raytracer"},
        "found": {"least_gap": 0.0},
    }


def _certificates() -> dict[str, Callable[[Data], Any]]:
    def outcome(**changes: Any) -> Callable[[Data], Any]:
        return lambda data: data["outcomes"][0].update(changes)

    def boxes(*values: Any) -> Callable[[Data], Any]:
        return outcome(boxes=[*values])

    def task(**changes: Any) -> Callable[[Data], Any]:
        return lambda data: data["policy"]["description"]["task"].update(changes)

    def of_cubes(count: int, values: list) -> Callable[[Data], Any]:
        def change(data: Data) -> None:
            task(num_cubes=count)(data)
            outcome(collected=[True] * count, boxes=values)(data)

        return change

    cells = [[[i / 2**14, (i + 1) / 2**14]] for i in range(150_000)]
    return {
        "nine_cubes": of_cubes(9, [[[-_EDGE, _EDGE]] * 9]),
        "eight_cubes_of_many_boxes": of_cubes(8, [[[-_EDGE, _EDGE]] * 8] * 5000),
        "eight_cubes_subnormal": of_cubes(8, [[[-5e-324, 5e-324]] * 8]),
        "subnormal_border": boxes([[-_EDGE, 5e-324]], [[5e-324, _EDGE]]),
        "tiny_border": boxes([[-_EDGE, 1e-200]], [[1e-200, _EDGE]]),
        "huge_border": boxes([[-1e300, 1e300]]),
        "many_boxes": boxes(*cells),
        "many_pairs": boxes([[0.0, 1.0]] * 500_000),
        "ragged": boxes([[-_EDGE, 0.0]], [[0.0]]),
        "box_of_texts": boxes([["a", "b"]]),
        "box_of_flags": boxes([[False, True]]),
        "box_of_none": boxes([None]),
        "box_as_mapping": boxes({"low": 0, "high": 1}),
        "box_turned": boxes([[_EDGE, -_EDGE]]),
        "boxes_as_text": outcome(boxes="all"),
        "boxes_as_mapping": outcome(boxes={"0": 1}),
        "steps_20001": outcome(steps={str(i): 0.0 for i in range(1, 20_002)}),
        "steps_as_list": outcome(steps=[14]),
        "steps_negative": outcome(steps={"-1": 1.0}),
        "steps_of_20_digits": outcome(steps={"9" * 20: 1.0}),
        "steps_of_other_digits": outcome(steps={"١٤": 1.0}),
        "collected_of_numbers": outcome(collected=[1]),
        "collected_empty": outcome(collected=[]),
        "end_unknown": outcome(end="running"),
        "share_of_7": outcome(share=7),
        "share_as_text": outcome(share="1"),
        "outcomes_3000": lambda data: data.update(outcomes=data["outcomes"] * 3000),
        "outcomes_as_mapping": lambda data: data.update(outcomes={}),
        "cubes_of_2_62": task(num_cubes=2**62),
        "camera_large": lambda data: data["policy"]["description"]["camera"].update(width=10**6),
        "layer_wide": lambda data: data["policy"]["description"]["network"].update(hidden=[10**9]),
        "weights_long": lambda data: data["policy"].update(weights="0" * 10**5),
        "name_of_lines": lambda data: data["policy"].update(name="a\nb"),
        "found_much": lambda data: data.update(found={"x": [0] * 5000}),
        "version_true": lambda data: data.update(format_version=True),
    }


def _measured(description: Data) -> Data:
    return {
        "format": "drone_rl shifts",
        "format_version": 1,
        "policy": "good",
        "network": {"weights": "0" * 64, "description": copy.deepcopy(description)},
        "settings": {},
        "terms": {},
        "plain": {},
        "axes": {},
        "together": {},
        "domain": None,
        "seconds": 1.0,
        "pictures": {},
    }


def _shifts() -> dict[str, Callable[[Data], Any]]:
    def part(**changes: Any) -> Callable[[Data], Any]:
        return lambda data: data.update(changes)

    return {
        "axes_unknown": part(axes={"luck": {}}),
        "axes_many": part(axes={f"a{i}": {} for i in range(10_000)}),
        "axes_as_list": part(axes=[1, 2]),
        "pictures_as_list": part(pictures=[]),
        "pictures_large": part(pictures={"fog": ["A" * 2**23] * 6}),
        "settings_many": part(settings={str(i): 0 for i in range(2000)}),
        "settings_deep": part(settings=_deep(40)),
        "terms_long": part(terms={"goal": "x" * 10**6}),
        "plain_as_text": part(plain="good"),
        "seconds_negative": part(seconds=-1),
        "weights_no_text": part(network={"weights": 5, "description": {}}),
        "more": part(hooks=["os.system"]),
        "policy_of_lines": part(policy="good\n\x1b[2J"),
        "domain_as_list": part(domain=[]),
    }


def _deep(levels: int) -> dict:
    return {"a": _deep(levels - 1)} if levels else {}
