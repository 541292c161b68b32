"""Conversion of a Markdown page to a notebook: Python blocks become code cells."""

import json
import re

_CODE = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)


def make_notebook(page: str) -> str:
    """Return the notebook (nbformat 4.5) as JSON.

    Args:
        page: Markdown with Python code blocks.
    """
    parts = _CODE.split(page)  # alternates between text and code
    cells = [_cell("code" if i % 2 else "markdown", part.strip()) for i, part in enumerate(parts)]
    numbered = [{"id": f"cell-{i}", **cell} for i, cell in enumerate(cells) if cell["source"]]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    notebook = {"cells": numbered, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(notebook, indent=1) + "\n"


def _cell(kind: str, source: str) -> dict[str, object]:
    outputs = {"execution_count": None, "outputs": []} if kind == "code" else {}
    return {"cell_type": kind, "metadata": {}, "source": source.splitlines(True), **outputs}
