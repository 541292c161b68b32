"""Where the figures on a page come from. Evidence: `explanation.json`, and "source", its name."""

from drone_rl.utils.schema import as_mapping
from drone_rl.utils.text import Evidence, Sentence


def _file(evidence: Evidence) -> str:
    revision = as_mapping(evidence.get("provenance", {}), "provenance").get("git_revision")
    return (
        f"This page repeats what {evidence['source']} says (written {_date(evidence)}, revision "
        f"{revision or 'unknown'}). The figures were read from this file and not measured again."
    )


def _date(evidence: Evidence) -> str:
    return str(evidence.get("date") or "on an unknown date")


SENTENCES = (Sentence("source.file", "always: a page is made from a file", lambda e: True, _file),)
