"""`python -m tools.schemas FOLDER`: write JSON schemas of result files; also a hook of MkDocs."""

import json
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.summary import Summary
from drone_rl.trust.bodies import Bodies
from drone_rl.trust.evaluate import Evaluation
from drone_rl.trust.judge import Judgement
from drone_rl.trust.shifts import Shifts
from drone_rl.utils.models import Model
from drone_rl.utils.run_result import RunResult
from drone_rl.utils.settings import meanings
from drone_rl.verification.chances import Chances
from drone_rl.verification.check import Check
from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.places import Places

RESULTS: dict[str, type[Model]] = {
    "bodies": Bodies,
    "certificate": Certificate,
    "chances": Chances,
    "check": Check,
    "evaluation": Evaluation,
    "places": Places,
    "result": RunResult,
    "shifts": Shifts,
    "summary": Summary,
    "sweep": Sweep,
    "verdict": Judgement,
}
"""Classes of result files by the file's name without its suffix."""


def describe(cls: type[Model]) -> None:
    """Give the fields of a class and its subclasses the descriptions in their docstrings."""
    texts = meanings(cls)
    for name, field in cls.model_fields.items():
        field.description = texts.get(name, field.description)
    if cls.__pydantic_complete__:  # the others are built when they are first used
        cls.model_rebuild(force=True)
    for subclass in cls.__subclasses__():
        describe(subclass)


def schemas() -> dict[str, str]:
    """Return JSON schemas by file name."""
    for result in Model.__subclasses__():
        describe(result)
    return {
        f"{name}.schema.json": json.dumps(result.model_json_schema(mode="serialization"), indent=2)
        for name, result in RESULTS.items()
    }


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the schemas to the site, next to the page of the file formats."""
    for name, content in schemas().items():
        files.append(File.generated(config, f"reference/{name}", content=content))
    return files


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in schemas().items():
        (folder / file).write_text(text + "\n", encoding="utf-8")
