"""What `drone-rl` alone prints, and the commands there are."""

USAGE = """\
drone-rl: a drone learns to fly from its camera, and you learn whether to trust it.

usage: drone-rl COMMAND [setting=value ...]

commands
  demo       train with the defaults, then evaluate, film and explain the result
  train      learn a policy; writes checkpoints and logs under outputs/train
  evaluate   test a policy on unseen worlds: table, JSON, videos
  play       film a policy, or watch it in dm_control's viewer
  explain    see what a policy sees, and whether to trust it: one HTML report
  report     make the report of explanations again, or of several side by side
  verdict    good, poor or one-sided? proved? as JSON and as an exit status
  prove      how does it end from every placement of the cubes? exactly, as a certificate
  check      does a certificate hold? flown anew; as JSON and as an exit status
  places     what does it do about one cube, wherever that stands? exactly, as a map
  shifts     under which other conditions is it good? light, camera, sizes, faults, motion
  bodies     what becomes of its verdict when its drone gets a body? wind, motors, cameras
  chain      how probable each end of an episode is, exactly, if moves are drawn
  export     write a policy as safetensors with a model card, or as an ONNX model
  sweep-report  compare the runs of a sweep: CSV, JSON, one HTML page
  bench      measure every figure that the README quotes

examples
  drone-rl train                       train with the defaults
  drone-rl train seed=1 device=cuda    change settings
  drone-rl train -m seed=0,1,2         one run for each value, side by side
  drone-rl train resume=RUN_FOLDER     go on with an interrupted run
  drone-rl evaluate                    test the newest policy
  drone-rl explain policy=good         explain a policy that travels with the package
  drone-rl COMMAND --help              every setting of a command
  drone-rl --version                   the version
"""
DEMO_USAGE = """\
drone-rl demo [setting=value ...]

Runs three commands, each into a folder of its own under outputs/:
  drone-rl train [setting=value ...]   with the settings that you give
  drone-rl evaluate                    the policy that came out
  drone-rl explain                     the same policy

The settings are those of drone-rl train; drone-rl train --help lists them.
"""
COMMANDS = (
    *("train", "evaluate", "play", "explain", "report", "verdict"),
    *("prove", "check", "places", "shifts", "bodies", "chain", "export", "sweep-report", "bench"),
)
"""Each a module of `drone_rl.cli` and a file in conf/; `demo` runs three of them."""
