"""Largest sizes of files in bytes, which readers check before they read."""

SMALL_JSON_BYTES = 10**6  # state of a training, reason of a failure
RESULT_BYTES = 2**18  # result.json
SWEEP_BYTES = 2**24  # sweep.json
EXPLANATION_BYTES = 2**22  # explanation.json
SHIFTS_BYTES = 2**26  # shifts.json, most of which are images
CERTIFICATE_BYTES = 2**25
LEDGER_BYTES = 2**24  # results of benchmarks
YAML_BYTES = 2**16  # overrides of a run, a required domain
METRICS_BYTES = 2**25  # metrics.csv of one run
LOG_BYTES = 2**16  # end of a log that is searched for an error
JOURNAL_BYTES = 2**23  # journal of a search by Optuna
CHECKPOINT_BYTES = 2**28  # also unpacked
ARRAYS_BYTES = 5 * 2**26  # arrays of an explanation, a demonstration or a proof; also unpacked
FILM_BYTES = 2**23  # the film of a report

FILM_STEPS = 2000  # steps of the film of a report

SCENE_XML_BYTES = 2**23  # one file of a scene, and all of them together
SCENE_ASSET_BYTES = 2**26  # one mesh, image or height field of a scene
SCENE_BYTES = 2**28  # all of them
SCENE_FILES = 1000
SCENE_ELEMENTS = 5_000  # bodies, geoms, sites and lights, copies included
SCENE_TRIANGLES = 500_000
SCENE_TEXELS = 2**24  # pixels of all textures
SCENE_CELLS = 2**22  # points of all height fields
