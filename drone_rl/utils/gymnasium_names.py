"""Names of the environments in Gymnasium's registry."""

ENVIRONMENTS = {
    "drone_rl/CollectCubes-v0": "collect_cubes",
    "drone_rl/Pillars-v0": "pillars",
}
"""Task of each Gymnasium environment; `gymnasium.make` takes its settings as options."""


def register() -> None:
    """Register the environments if Gymnasium is installed; they are imported when one is made."""
    try:
        import gymnasium  # an optional extra
    except ImportError:
        return
    for name, task in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="drone_rl:DroneWorld",
                vector_entry_point="drone_rl:DroneWorlds",
                kwargs={"task": task},
            )
