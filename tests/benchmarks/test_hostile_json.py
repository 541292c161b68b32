"""Malicious JSON and YAML for each reader."""

import json

import pytest
import yaml

from benchmarks.hostile_json import JSON, YAML, hostile_json


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    folder = tmp_path_factory.mktemp("json")

    def run(path):
        (path / ".hydra").mkdir(parents=True)
        return path

    return hostile_json(folder, run)


def test_every_reader_gets_every_content(cases):
    names = {name for name, *_ in cases}
    assert len(names) == len(cases)
    for reader in ("certificate_{}.json", "shifts_{}.json", "sweep_file_{}", "run_rounds_{}"):
        assert names >= {reader.format(content) for content in JSON}
    assert names >= {f"domain_{content}.yaml" for content in YAML}


def test_contents_have_the_defects_that_their_names_state():
    assert json.loads(JSON["many_names"])["299999"] == 0
    with pytest.raises(RecursionError):
        json.loads(JSON["deep_lists"])
    shared = yaml.safe_load(YAML["aliases"])
    assert shared["b"][0] is shared["a"]
    with pytest.raises(ValueError, match="month"):
        yaml.safe_load(YAML["date_that_is_none"])
