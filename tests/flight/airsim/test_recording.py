"""Recordings: a table that numpy reads, and its images."""

import numpy as np
import pytest
from PIL import Image

from tests.flight.airsim.conftest import pose


def test_a_recording_is_a_table_and_images(start, tmp_path):
    _server, client = start(recordings=tmp_path / "recordings")
    client.call("enableApiControl", True)
    client.call("startRecording")
    client.call("startRecording")  # goes on
    assert client.call("isRecording") is True
    client.call("takeoff", 20.0)
    client.call("stopRecording")
    assert client.call("isRecording") is False
    (folder,) = (tmp_path / "recordings").iterdir()
    rows = np.genfromtxt(folder / "airsim_rec.txt", names=True, dtype=None, encoding="utf-8")
    assert rows["POS_Z"][-1] < -1.8
    assert np.diff(rows["TimeStamp"]).mean() == pytest.approx(50.0, abs=1.0)  # milliseconds
    for name in rows["ImageFile"]:
        assert Image.open(folder / "images" / name).size == (256, 144)


def test_rows_and_images_are_those_of_the_settings(start, tmp_path):
    """Every 0.2 s, but without a move no row"""
    text = f"""{{"SimMode": "ComputerVision", "Recording": {{"RecordOnMove": true,
      "RecordInterval": 0.2, "Enabled": true, "Folder": "{tmp_path}", "Cameras": [
        {{"CameraName": "3", "ImageType": 1, "PixelsAsFloat": true}},
        {{"CameraName": "0", "ImageType": 5, "Compress": false}}]}}}}"""
    _server, client = start(text)
    assert client.call("isRecording") is True
    for x in (1.0, 2.0):
        client.call("simSetVehiclePose", pose(x, 0.0, 0.0), True, "")
        client.call("simContinueForTime", 0.6)
    client.call("stopRecording")
    (table,) = tmp_path.glob("*/airsim_rec.txt")
    rows = np.genfromtxt(table, names=True, dtype=None, encoding="utf-8")
    assert rows["POS_X"].tolist() == [1.0, 2.0]
    depth, ids = rows["ImageFile"][0].split(";")
    content = (table.parent / "images" / depth).read_bytes()
    assert content.startswith(b"Pf\n256 144\n-1.0\n")
    assert np.frombuffer(content[-4 * 256 * 144 :], "<f4").min() > 0.5
    assert ids.startswith("img_ComputerVision_0_5_") and ids.endswith(".ppm")
    assert Image.open(table.parent / "images" / ids).size == (256, 144)


def test_vehicles_whose_names_have_the_same_letters_have_their_own_images(start, tmp_path):
    names = '"A-1": {}, "A_1": {"X": 4}, "red drone #1": {}, "../": {}'
    text = f'{{"SimMode": "ComputerVision", "Vehicles": {{{names}}}}}'
    _server, client = start(text, recordings=tmp_path)
    client.call("startRecording")
    client.call("stopRecording")
    assert len([*tmp_path.glob("*/images/*.png")]) == 4
    (table,) = tmp_path.glob("*/airsim_rec.txt")
    rows = np.genfromtxt(table, names=True, dtype=None, encoding="utf-8")
    assert rows["VehicleName"].tolist() == ["A-1", "A_1", "red_drone__1", "../"]
