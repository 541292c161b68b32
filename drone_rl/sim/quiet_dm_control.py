"""Parts of dm_control, imported without GLFW's warning about a missing display."""

import warnings

with warnings.catch_warnings():
    warnings.filterwarnings("ignore", ".*DISPLAY")  # only images of OpenGL need a display
    from dm_control import composer as composer
    from dm_control import mjcf as mjcf
    from dm_control.composer.observation import observable as observable
    from dm_control.mujoco import engine as engine
