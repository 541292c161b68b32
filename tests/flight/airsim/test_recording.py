"""Recordings: a table that numpy reads, and its images."""

import numpy as np
from PIL import Image

from drone_rl.flight.airsim.recording import INTERVAL, to_letters


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
    assert np.diff(rows["TimeStamp"]).min() >= INTERVAL * 1e9 - 1
    for name in rows["ImageFile"]:
        assert Image.open(folder / "images" / name).size == (256, 144)


def test_numpy_reads_rows_of_any_name(start, tmp_path):
    text = """{"SimMode": "ComputerVision", "Vehicles": {"red drone #1": {}}}"""
    _server, client = start(text, recordings=tmp_path)
    client.call("startRecording")
    client.call("simContinueForTime", 0.1)
    client.call("stopRecording")
    (table,) = tmp_path.glob("*/airsim_rec.txt")
    rows = np.genfromtxt(table, names=True, dtype=None, encoding="utf-8")
    assert set(rows["VehicleName"]) == {"red_drone__1"}


def test_names_of_files_hold_letters_alone():
    assert to_letters("../a b/ü") == "___a_b__"


def test_vehicles_whose_names_have_the_same_letters_have_their_own_images(start, tmp_path):
    text = """{"SimMode": "ComputerVision", "Vehicles": {"A-1": {}, "A_1": {"X": 4}}}"""
    _server, client = start(text, recordings=tmp_path)
    client.call("startRecording")
    client.call("stopRecording")
    assert len([*tmp_path.glob("*/images/*.png")]) == 2
