"""Conversion of a Markdown page to a notebook."""

import json

from tools.readme.notebook import make_notebook


def test_python_blocks_become_code_cells_and_the_rest_text():
    first, last = "```python\nx = 1\n\ny = 2\n```\n", "```python\nx\n```\n"
    page = f"# Title\n\nWords.\n\n{first}\n```sh\nls\n```\n\n{last}"
    made = json.loads(make_notebook(page))
    assert [(cell["cell_type"], "".join(cell["source"])) for cell in made["cells"]] == [
        ("markdown", "# Title\n\nWords."),
        ("code", "x = 1\n\ny = 2"),
        ("markdown", "```sh\nls\n```"),
        ("code", "x"),
    ]
    assert made["nbformat"] == 4 and len({cell["id"] for cell in made["cells"]}) == 4
    assert all(cell["outputs"] == [] for cell in made["cells"] if cell["cell_type"] == "code")


def test_a_titled_block_is_text():
    (cell,) = json.loads(make_notebook('```python title="a.py"\nx = 1\n```\n'))["cells"]
    assert cell["cell_type"] == "markdown"
