"""Our environments by Gymnasium's names.

`import drone_rl` makes them known as soon as Gymnasium is imported, before or after, so that nobody
need call anything; Gymnasium 1 itself looks for no plug-ins. `gymnasium.make("drone_rl:" + name)`
imports drone_rl by itself.
"""

ENVIRONMENTS = {
    "drone_rl/CollectCubes-v0": "drone_rl.config.TaskSettings",
    "drone_rl/Pillars-v0": "drone_rl.config.PillarsSettings",
}
"""By name, the class of the task's settings, which `gymnasium.make` takes as options."""


def register() -> None:
    """Makes them known to Gymnasium; those that are known already stay as they are."""
    import gymnasium  # slow to import, and not everybody has it

    for name, task in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="drone_rl:DroneWorld",
                vector_entry_point="drone_rl:DroneWorlds",
                kwargs={"task": task},
            )
