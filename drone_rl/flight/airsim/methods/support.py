"""What the server does not do, or does in part, of AirSim's methods."""


def _each(names: str, words: str) -> dict[str, str]:
    return dict.fromkeys(names.split(), words)


UNSUPPORTED = {
    **_each(
        "getLidarData simGetLidarSegmentation getDistanceSensorData simGetWorldExtents "
        "simCreateVoxelGrid",
        "lidar, distance sensors and voxel grids; use depth images by simGetImages",
    ),
    **_each(
        "simSetObjectMaterial simSetObjectMaterialFromTexture simSwapTextures simLoadLevel "
        "simSpawnAsset simGetMeshPositionVertexBuffers simCharSetFacePreset",
        "materials, levels and assets of Unreal; give a scene as an MJCF file",
    ),
    **_each("setCarControls getCarControls getCarState", "cars; use a multirotor"),
    **_each(
        "simGetFilmbackSettings simGetPresetFilmbackSettings simGetPresetLensSettings "
        "simGetLensSettings simGetFocalLength simGetCurrentFieldOfView simSetFilmbackSettings "
        "simSetPresetFilmbackSettings simSetPresetLensSettings simSetFocalLength "
        "simEnableManualFocus simSetFocusDistance simGetFocusDistance simSetFocusAperture "
        "simGetFocusAperture simEnableFocusPlane simSetDistortionParam simGetDistortionParams",
        "lenses and film cameras of Unreal; use simGetCameraInfo and simSetCameraFov",
    ),
}
"""Methods that AirSim has and this server does not, with what is missing and the alternative."""
GAINS = (
    "setAngleRateControllerGains setAngleLevelControllerGains setVelocityControllerGains "
    "setPositionControllerGains"
)
"""Methods that set the gains of AirSim's controller."""
NOT_SHOWN = (
    "simPrintLogMessage simSetTraceLine simFlushPersistentMarkers simPlotPoints simPlotLineStrip "
    "simPlotLineList simPlotArrows simPlotStrings simPlotTransforms simPlotTransformsWithNames "
    "simToggleCameraWindow"
)
"""Methods that change only what Unreal's window shows."""
_HIDDEN = "boxes that can be touched hide; other objects do not"
_FOR_ALL = "for all image types of a camera"
_TYPES = "types 0 to 7; vehicles do not see each other"

PARTLY = {
    "simSpawnObject": "cube, sphere or cylinder, four of each; vehicles fly through them",
    "simSetObjectPose": "poses of vehicles; only positions of other objects",
    "simGetObjectScale": "one factor; 1 for objects that were not spawned",
    "simSetObjectScale": "one factor, of spawned objects",
    "simSetLightIntensity": "returns false: there are no lights by name; use simSetTimeOfDay",
    "simSetKinematics": "accelerations are ignored",
    "simGetDetections": "box2D is of the pixels that are seen, box3D around a ball",
    "simAddDetectionFilterMeshName": _FOR_ALL,
    "simSetDetectionFilterRadius": _FOR_ALL,
    "simClearDetectionMeshNames": _FOR_ALL,
    "simTestLineOfSightBetweenPoints": _HIDDEN,
    "simSetWeatherParameter": "fog; others are accepted without effect",
    "simSetTimeOfDay": "the sun's place at that hour, which then stands still",
    "simAddVehicle": "SimpleFlight and ComputerVision",
    "simRunConsoleCommand": "returns false",
    "simGetImages": _TYPES,
    "simGetImage": _TYPES,
    "simGetGroundTruthEnvironment": "the standard atmosphere",
    "simContinueForFrames": "a frame is a control period, 21 ms",
    "simTestLineOfSightToPoint": _HIDDEN,
    "simListAssets": "shapes for simSpawnObject",
    **_each(GAINS, "accepted, without effect: gains are settings of the dynamics"),
    **_each(NOT_SHOWN, "accepted, without effect: there is no window"),
}
"""Methods that do only a part of what AirSim's do, with that part."""
