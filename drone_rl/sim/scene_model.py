"""The MuJoCo model of a task: field, drone, props and distractors."""

from typing import Any

from drone_rl.config import CameraSettings
from drone_rl.sim import entities
from drone_rl.sim.rendering.scene import Headlight, Scene, SemanticClass, compiled
from drone_rl.sim.tasks import Task
from drone_rl.utils.plugins import errors_of, place_of


class SceneModel:
    """A field with the drone and a task's props, which dm_control composes."""

    def __init__(self, task: Task[Any], camera: CameraSettings, distractors: int = 0) -> None:
        """Compose the model; raise an `InputError` if the task's props fail."""
        self.name = f"task={task.name}"
        scenes = getattr(task, "scenes", ())
        self._is_file = bool(scenes)
        self._sky = (0.0, 0.0, 0.0) if scenes else entities.SKY_COLOR
        self.field = entities.Field(scenes)
        model: Any = self.field.mjcf_model
        model.option.gravity = (0, 0, 0)
        # a small drone's camera must not look through a wall that the drone can't pass
        mount = min(1.0, task.drone_size / entities.CARRIER) if scenes else 1.0
        self.drone = entities.DroneEntity(size=task.drone_size, camera=camera, mount=mount)
        self.field.add_free_entity(self.drone)
        with errors_of(self.name, place_of(task.make_props)):
            props = task.make_props()
        self.props = [*props, *entities.make_distractors(distractors)]
        self.frames = [self.field.attach(prop) for prop in self.props]
        """What moves each prop."""
        for frame in self.frames:
            frame.mocap = True

    def compile(self) -> Scene:
        """Return the compiled model with the semantic classes of its geoms."""
        field: Any = self.field.mjcf_model  # None in dm_control's annotations
        physics = compiled(field, f"the scene of {self.name}")
        model = physics.model.ptr
        classes, props = [SemanticClass.GROUND] * model.ngeom, [-1] * model.ngeom
        for number, entity in [(-1, self.drone), *enumerate(self.props)]:
            for geom in physics.bind(entity.mjcf_model.find_all("geom")).element_id:
                classes[geom], props[geom] = entity.semantic_class, number
        heads = tuple(
            Headlight.of(prop.file, number)
            for number, prop in enumerate(self.props)
            if isinstance(prop, entities.SceneEntity)
        )
        return Scene(model, tuple(classes), tuple(props), self._sky, self._is_file, heads)
