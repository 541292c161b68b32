"""settings.json as AirSim reads it, the chapter's listings verbatim, and wrong values."""

import json
import logging
import math
import time

import pytest

from drone_rl.flight.airsim.settings_file import (
    AirsimSettings,
    Capture,
    VehicleChoice,
    find_settings,
    parse_settings,
    read_settings,
)
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.utils.errors import InputError

LISTING_1 = """{
  'SettingsVersion': 1.0
}
"""
LISTING_2 = """{
  'SettingsVersion': 1.0,
  'SimMode': 'Multirotor',
  'UsageScenario': 'ComputerVision'
}
"""
FULL = """
{
  // a comment with "quotes" and 'others'
  "SettingsVersion": 1.2,
  "SimMode": "Multirotor", /* over
  lines */
  "ApiServerPort": 41460, "LocalHostIp": "127.0.0.1", "ClockSpeed": 2,
  "OriginGeopoint": {"Latitude": 10.5, "Longitude": -20, "Altitude": 30},
  "Wind": {"X": 1, "Y": -2, "Z": 0.5},
  "ViewMode": "NoDisplay",
  "CameraDefaults": {"CaptureSettings": [
     {"ImageType": 0, "Width": 320, "Height": 240, "FOV_Degrees": 120},
     {"ImageType": 1, "Width": 64}]},
  "SegmentationSettings": {"InitMethod": "None"},
  "Vehicles": {
    "One": {"VehicleType": "SimpleFlight", "X": 4, "Y": 0, "Z": -2, "Yaw": 90,
      "Cameras": {"0": {"X": 0.5, "Pitch": -15, "CaptureSettings": [{"Width": 32, "Height": 16}]}}},
    "Two": {"VehicleType": "ComputerVision", "AllowAPIAlways": true},
    "Three": {"AutoCreate": false, "VehicleType": "SimpleFlight"},
  },
}
"""


def test_listing_1_means_one_multirotor():
    found = parse_settings(LISTING_1)
    ((name, vehicle),) = found.choices.items()
    assert name == vehicle.vehicle_type == "SimpleFlight"
    assert vehicle.default_vehicle_state == "Armed"
    assert (found.address, found.port, found.clock_speed) == ("127.0.0.1", 41451, 1.0)
    assert found.home == HOME
    assert json.loads(found.text) == {"SettingsVersion": 1.0}


def test_listing_2_means_computer_vision():
    (vehicle,) = parse_settings(LISTING_2).choices.values()
    assert vehicle.vehicle_type == "ComputerVision"


def test_all_parts_of_a_file():
    found = parse_settings(FULL)
    assert (found.port, found.clock_speed) == (41460, 2.0)
    assert (found.wind.x, found.wind.y, found.wind.z) == (1.0, -2.0, 0.5)
    assert found.home == GeoPoint(10.5, -20.0, 30.0)
    assert found.segmentation_settings.init_method == "None"
    assert found.camera_defaults.captures == {
        ImageType.SCENE: Capture(320, 240, 120.0),
        ImageType.DEPTH_PLANAR: Capture(64, 144, 90.0),
    }
    assert [*found.choices] == ["One", "Two"]
    one, two = found.choices.values()
    assert (one.vehicle_type, *one.position, one.yaw) == ("SimpleFlight", 4.0, 0.0, -2.0, 90.0)
    camera = one.cameras["front_center"]
    assert (camera.x, camera.pitch) == (0.5, -15.0) and math.isnan(camera.y)
    assert camera.captures == {ImageType.SCENE: Capture(32, 16, 90.0)}
    assert two == VehicleChoice(vehicle_type="ComputerVision", has_api_control=True)


def test_quotes_comments_and_commas():
    text = (
        """{'Vehicles': {'a//b': {}, "c": {}, 'it\\'s': {}, 'say "x"': {} /* last */ }, // end\n}"""
    )
    assert [*parse_settings(text).choices] == ["a//b", "c", "it's", 'say "x"']


def test_null_nan_and_nothing_mean_the_default():
    given = dict.fromkeys(("SimMode", "UsageScenario", "ClockSpeed", "ApiServerPort", "Vehicles"))
    given |= {"OriginGeopoint": {"Latitude": None}, "LocalHostIp": ""}
    found = parse_settings(json.dumps({**given, "Wind": {"X": math.nan, "Y": 2}}))
    assert found.model_copy(update={"text": "{}"}) == AirsimSettings.read({"Wind": {"Y": 2}})


def test_keys_without_effect_are_warned_about(caplog):
    with caplog.at_level(logging.WARNING):
        parse_settings('{"SimMod": "Multirotor", "ViewMode": "", "Vehicles": {"A": {"Camera": 1}}}')
    first, second, third = (record.getMessage() for record in caplog.records)
    assert first == "settings: SimMod has no effect here; did you mean SimMode?"
    assert second == "settings: ViewMode has no effect here"
    assert "did you mean Cameras" in third


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{'SimMode': 'Car'}", "SimMode='Car': it must be 'Multirotor' or 'ComputerVision'"),
        ("{'ApiServerPort': 70000}", "ApiServerPort=70000: it must be less than"),
        ("{'Vehicles': {'A': {'VehicleType': 'PhysXCar'}}}", "PhysXCar is not supported"),
        ("{'Vehicles': {'A': {'Cameras': {'side': {}}}}}", r"A\.Cameras.*'side' is unknown"),
        ("{'Recording': {'Cameras': [{'CameraName': 'left'}]}}", "CameraName.*'left' is unknown"),
        ("{/* a\n\n */\n'a': }", "line 4 is not JSON"),
        ('{"a": ' + "1" * 5000 + "}", "too many digits"),
        ("[" * 100_000, "nested too deeply|not JSON"),
    ],
)
def test_wrong_values_are_refused_with_their_place(text, message):
    with pytest.raises(InputError, match=message) as caught:
        parse_settings(text, "mine.json")
    assert str(caught.value).startswith("mine.json")
    assert "\n" not in str(caught.value)


def test_files_that_can_not_be_read(tmp_path):
    with pytest.raises(InputError, match="can't be read"):
        read_settings(tmp_path / "none.json")
    (tmp_path / "latin.json").write_bytes(b'{"a": "\xe9"}')
    with pytest.raises(InputError, match="not text in UTF-8"):
        read_settings(tmp_path / "latin.json")
    (tmp_path / "bom.json").write_text("\ufeff" + LISTING_1, "utf-8")
    assert read_settings(tmp_path / "bom.json").port == 41451


@pytest.mark.parametrize("text", ["/* " * 30_000, '"' + '\\"' * 30_000, "'" + "\\'" * 30_000])
def test_what_is_never_closed_is_refused_in_linear_time(text):
    begin = time.perf_counter()
    with pytest.raises(InputError, match="not JSON"):
        parse_settings(text)
    assert time.perf_counter() - begin < 2.0


def test_px4_is_warned_about(caplog):
    parse_settings('{"Vehicles": {"A": {"VehicleType": "PX4Multirotor"}}}')
    assert "there is no PX4" in caplog.text


def test_settings_are_found_where_airsim_looks_for_them(tmp_path, monkeypatch):
    here, documents = tmp_path / "here", tmp_path / "Documents" / "AirSim"
    here.mkdir()
    documents.mkdir(parents=True)
    monkeypatch.chdir(here)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert find_settings() is None
    (documents / "settings.json").write_text("{'SettingsVersion': 1, 'ApiServerPort': 5}")
    assert find_settings().port == 5
    (here / "settings.json").write_text("{'Vehicles': {'A': {}}, 'ApiServerPort': 6}")
    assert find_settings().port == 6


@pytest.mark.parametrize("text", ['{"LocalHostIp": "0.0.0.0"}', "[]", "<xml>", "\ud800"])
def test_a_file_of_another_program_is_ignored(tmp_path, monkeypatch, caplog, text):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "settings.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    assert find_settings() is None
    assert "settings.json is ignored" in caplog.text


def test_a_file_that_is_not_named_does_not_open_the_server(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "settings.json").write_text('{"SimMode": "", "LocalHostIp": "0.0.0.0"}')
    assert find_settings().address == "127.0.0.1"
    assert "LocalHostIp='0.0.0.0' is ignored" in caplog.text
    (tmp_path / "settings.json").write_text('{"SimMode": "Car"}')
    with pytest.raises(InputError, match=r"settings\.json.*give settings=FILE or settings=none"):
        find_settings()
