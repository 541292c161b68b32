"""A page becomes a notebook of text and code, in order."""

import json

from tools.readme.notebook import make_notebook


def test_python_is_code_and_all_else_is_text():
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


def test_a_file_in_a_block_with_a_title_is_text():
    (cell,) = json.loads(make_notebook('```python title="a.py"\nx = 1\n```\n'))["cells"]
    assert cell["cell_type"] == "markdown"
