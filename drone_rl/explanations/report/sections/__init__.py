"""The parts of a report, one a file: see `explanations/report/part.py`."""

import importlib
import pkgutil

from drone_rl.explanations.report.part import Part


def find_parts() -> dict[str, Part]:
    """All parts by the names of their modules, in the order of the page."""
    names = [module.name for module in pkgutil.iter_modules(__path__)]
    parts = {name: importlib.import_module(f"{__name__}.{name}").PART for name in names}
    return dict(sorted(parts.items(), key=lambda item: (item[1].place, item[0])))
