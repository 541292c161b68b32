"""Figures of the documentation are plotted from kept results."""

import json

from PIL import Image

from tools.figures import main

SCORE = {"mean": 0.3, "lower95": 0.1, "upper95": 0.5}
TRUTH = {
    "methods": {
        "grad_cam": {"score": SCORE, "trusted": False},
        "saliency": {"score": SCORE, "trusted": True},
    },
    "placebos": {"noise": {"mean": 0.0, "lower95": -0.2, "upper95": 0.2}},
}


def test_placebos_are_plotted_from_an_explanation(tmp_path):
    folder = tmp_path / "explain" / "good"
    folder.mkdir(parents=True)
    (folder / "explanation.json").write_text(json.dumps({"name": "good", "truth": TRUTH}))
    assert main(["placebos", str(folder.parent)], tmp_path) == 0
    assert Image.open(tmp_path / "placebos.png").size == (1020, 504)
