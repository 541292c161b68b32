from drone_rl.explanations.report.behavior import say_source


def test_a_page_names_the_file_that_its_figures_were_read_from():
    evidence = {
        "source": "a/explanation.json",
        "date": "2026-01-31T12:00:00+00:00",
        "provenance": {"git_revision": "0123abc"},
    }
    assert say_source(evidence)["source.file"] == (
        "This page repeats what a/explanation.json says (written 2026-01-31T12:00:00+00:00, "
        "revision 0123abc). The figures were read from this file and not measured again."
    )
    older = say_source({"source": "a/explanation.json"})["source.file"]
    assert "written on an unknown date, revision unknown" in older
