"""The loop of `drone_rl.training.train` for a trainer that a test makes itself."""


def run(trainer):
    """Train until the trainer's batches end; return its reason."""
    with trainer.running() as batches:
        for batch in batches:
            trainer.finish_update(batch, trainer.learner.update(batch))
    return trainer.reason
