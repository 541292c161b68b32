"""Exit codes of `drone-rl`; 0 is success."""

USER_ERROR = 2  # a setting or file is unusable, or output can't be written
POOR = 10  # `verdict` and `explain`: kinds of policies, here and below
ONE_SIDED = 11
NO_KIND = 12
NOT_CERTAIN = 13  # too few episodes to be certain of the kind, or repeated ones end otherwise
CERTIFICATE_REFUSED = 14  # `check`
NOT_PROVED = 15  # `prove`: some placements fail or are undecided
PROOF_MISSING = 16  # `verdict`: no certificate proves every placement, which `require` demands
NOT_COVERED = 17  # `verdict`: the policy is not certainly good in the required operating domain
TRIVIAL = 18  # `verdict` and `explain`: good, but a baseline succeeds without observations
INTERRUPTED = 128 + 2  # Ctrl-C, as if SIGINT ended the process
OUTPUT_CLOSED = 128 + 13  # standard output is closed, as if SIGPIPE ended the process
