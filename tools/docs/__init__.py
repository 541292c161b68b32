"""Run every command and code block of README.md and docs/, and compare the output that they show.

`python -m tools.docs [--update | --time] [PAGE ...]` runs pages, by default all. `--update` writes
the printed outputs into the pages; `--time` runs commands as printed, without smaller sizes.

Each page runs in a copy of the checkout, from top to bottom:

- A command (a line of a block `sh` or `bash`, or after `$` in a block `console`) runs in bash. It
  must exit with the status that its comment names ("exit status 11"), or else with 0.
- A Python block runs in the same interpreter as the earlier ones of its page. A block with a title
  is written to a file of that name.
- The output shown is the text below a command in a block `console`, or a block `text` or `json`
  below the code. `[...]` stands for omitted text; text before and after may be omitted, too.
  Line breaks do not count. `outputs.py` lists the parts that may differ, such as seconds.
- `pages.toml` lists blocks that are not run, each with the reason, and commands that run with
  smaller sizes. Nothing else is skipped.
"""
