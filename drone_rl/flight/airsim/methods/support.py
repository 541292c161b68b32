"""What the server does not do, or does in part, of AirSim's methods."""

UNSUPPORTED = {
    "simGetLidarSegmentation": "lidar",
    "getLidarData": "lidar; use depth images by simGetImages",
    "getDistanceSensorData": "distance sensors; use depth images by simGetImages",
    "setCarControls": "cars; use a multirotor",
    "getCarState": "cars; use getMultirotorState",
    "getCarControls": "cars; use a multirotor",
    "simSetObjectMaterial": "materials of Unreal; give a scene as an MJCF file",
    "simSetObjectMaterialFromTexture": "materials of Unreal; give a scene as an MJCF file",
    "simSwapTextures": "textures of Unreal; give a scene as an MJCF file",
    "simLoadLevel": "levels of Unreal; start a server with another scene",
    "simSpawnAsset": "assets of Unreal; simSpawnObject makes cubes, spheres and cylinders",
    "simGetMeshPositionVertexBuffers": "meshes of Unreal; give a scene as an MJCF file",
    "simCharSetFacePreset": "characters of Unreal",
    "simGetWorldExtents": "voxel grids",
    "simCreateVoxelGrid": "voxel grids; use depth images by simGetImages",
    "simGetFilmbackSettings": "film cameras of Unreal; use simGetCameraInfo",
    "simSetFilmbackSettings": "film cameras of Unreal; use simSetCameraFov",
    "simGetPresetFilmbackSettings": "film cameras of Unreal; use simGetCameraInfo",
    "simSetPresetFilmbackSettings": "film cameras of Unreal; use simSetCameraFov",
    "simGetPresetLensSettings": "film cameras of Unreal; use simGetCameraInfo",
    "simGetLensSettings": "film cameras of Unreal; use simGetCameraInfo",
    "simSetPresetLensSettings": "film cameras of Unreal; use simSetCameraFov",
    "simSetFocalLength": "film cameras of Unreal; use simSetCameraFov",
    "simGetFocalLength": "film cameras of Unreal; use simGetCameraInfo",
    "simEnableManualFocus": "film cameras of Unreal",
    "simSetFocusDistance": "film cameras of Unreal",
    "simGetFocusDistance": "film cameras of Unreal",
    "simSetFocusAperture": "film cameras of Unreal",
    "simGetFocusAperture": "film cameras of Unreal",
    "simEnableFocusPlane": "film cameras of Unreal",
    "simGetCurrentFieldOfView": "film cameras of Unreal; use simGetCameraInfo",
    "simSetDistortionParam": "lens distortion of Unreal",
    "simGetDistortionParams": "lens distortion of Unreal",
}
"""Methods that AirSim has and this server does not, with what is missing and the alternative."""
GAINS = (
    "setAngleRateControllerGains",
    "setAngleLevelControllerGains",
    "setVelocityControllerGains",
    "setPositionControllerGains",
)
"""Methods that set the gains of AirSim's controller."""
NOT_SHOWN = (
    *("simPrintLogMessage", "simSetTraceLine", "simFlushPersistentMarkers"),
    *("simPlotPoints", "simPlotLineStrip", "simPlotLineList", "simPlotArrows"),
    *("simPlotStrings", "simPlotTransforms", "simPlotTransformsWithNames"),
    "simToggleCameraWindow",
)
"""Methods that change only what Unreal's window shows."""

PARTLY = {
    "simSpawnObject": "cube, sphere or cylinder, four of each; vehicles fly through them",
    "simSetObjectPose": "poses of vehicles; only positions of other objects",
    "simGetObjectScale": "one factor; 1 for objects that were not spawned",
    "simSetObjectScale": "one factor, of spawned objects",
    "simSetLightIntensity": "returns false: there are no lights by name; use simSetTimeOfDay",
    "simSetKinematics": "accelerations are ignored",
    "simGetDetections": "box2D is of the pixels that are seen, box3D around a ball",
    "simAddDetectionFilterMeshName": "for all image types of a camera",
    "simSetDetectionFilterRadius": "for all image types of a camera",
    "simClearDetectionMeshNames": "for all image types of a camera",
    "simTestLineOfSightBetweenPoints": "boxes that can be touched hide; other objects do not",
    "simSetWeatherParameter": "fog; others are accepted without effect",
    "simSetTimeOfDay": "the sun's place at that hour, which then stands still",
    "simAddVehicle": "SimpleFlight and ComputerVision",
    "simRunConsoleCommand": "returns false",
    "simGetImages": "types 0 to 7; vehicles do not see each other",
    "simGetImage": "types 0 to 7; vehicles do not see each other",
    "simGetGroundTruthEnvironment": "the standard atmosphere",
    "simContinueForFrames": "a frame is a control period, 21 ms",
    "simTestLineOfSightToPoint": "boxes that can be touched hide; other objects do not",
    "simListAssets": "shapes for simSpawnObject",
    **dict.fromkeys(GAINS, "accepted, without effect: gains are settings of the dynamics"),
    **dict.fromkeys(NOT_SHOWN, "accepted, without effect: there is no window"),
}
"""Methods that do only a part of what AirSim's do, with that part."""
