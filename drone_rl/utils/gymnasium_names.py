"""Names of the tasks' environments in Gymnasium's registry."""


def environment_id(task: str) -> str:
    """Return the name of a task's environment: "drone_rl/ReachBall-v0" of reach_ball."""
    return f"drone_rl/{task.title().replace('_', '')}-v0"


def register_environment(task: str) -> None:
    """Register the environment of a task if Gymnasium is installed; it is imported when made."""
    try:
        import gymnasium  # an optional extra
    except ImportError:
        return
    if environment_id(task) not in gymnasium.registry:
        gymnasium.register(
            environment_id(task),
            entry_point="drone_rl:DroneWorld",
            vector_entry_point="drone_rl:DroneWorlds",
            kwargs={"task": task},
        )
