"""Programs that move a vehicle by commands."""

import contextlib
import io
import math
from typing import Any

from benchmarks.airsim_programs.program import Near, program
from benchmarks.airsim_programs.session import Session

Found = dict[str, Any]


@program(since="airsim-1.2", upgrade=False, armed=True, control=[False, True], refused=True)
def hello(s: Session) -> Found:
    """Connect without a warning; a method that is not supported is refused."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        s.client.confirmConnection()
    control = [s.client.isApiControlEnabled()]
    s.client.enableApiControl(True)
    control.append(s.client.isApiControlEnabled())
    try:
        s.client.getLidarData()
        refused = False
    except Exception as error:  # each transport has its own class
        refused = "getLidarData is not supported" in str(error)
    armed = s.client.armDisarm(True)
    upgrade = "upgrade" in printed.getvalue()
    return {"upgrade": upgrade, "armed": armed, "control": control, "refused": refused}


@program(climbed=Near(-2.0, 0.2), seconds=Near(4.0, 0.2), flying=True)
def take_off(s: Session) -> Found:
    """Climb 2 m at 0.5 m/s: 4 s."""
    s.client.enableApiControl(True)
    s.client.armDisarm(True)
    begin = s.seconds()
    s.fly("takeoff")
    state = s.client if s.is_first else s.client.getMultirotorState()
    landed = state.getLandedState() if s.is_first else state.landed_state
    return {"climbed": s.place()[2], "seconds": s.seconds() - begin, "flying": landed == 1}


@program(
    end=Near([25.0, 20.0, -4.0], 0.5), seconds=Near(45.0, 2.25), result=True, facing=Near(90.0, 5.0)
)
def path(s: Session) -> Found:
    """Fly 25 m north, then 20 m east, at 1 m/s: 45 m in 45 s, facing east at the end."""
    s.take_off()
    s.fly("moveToZ", -4, 3)
    begin = s.seconds()
    points = [s.vector(25, 0, -4), s.vector(25, 20, -4)]
    forward, ahead = s.airsim.DrivetrainType.ForwardOnly, s.airsim.YawMode(False, 0)
    result = s.fly("moveOnPath", points, 1, 120, forward, ahead)
    seconds = s.seconds() - begin
    return {"end": s.place(), "seconds": seconds, "result": result, "facing": s.angles()[1]}


@program(corners=Near([[5, 0, -4], [5, 5, -4], [0, 5, -4], [0, 0, -4]], 0.5))
def positions(s: Session) -> Found:
    """Fly to the corners of a square, one after the other."""
    s.take_off()
    corners = []
    for x, y in ((5, 0), (5, 5), (0, 5), (0, 0)):
        s.fly("moveToPosition", x, y, -4, 2)
        corners.append(s.place())
    return {"corners": corners}


@program(end=Near([20.0, 20.0, -4.0], 0.5), seconds=Near(36.5, 1.8))
def survey(s: Session) -> Found:
    """Fly three lanes of 20 m, 10 m apart, at 2.5 m/s: 80 m in 32 s.

    The start and each of four corners cost 0.9 s, by which the speed lags.
    """
    s.take_off()
    s.fly("moveToZ", -4, 3)
    points = []
    for lane in range(3):
        ends = (0, 20) if lane % 2 == 0 else (20, 0)
        points += [s.vector(x, 10 * lane, -4) for x in ends]
    begin = s.seconds()
    s.fly("moveOnPath", points[1:], 2.5, 120)
    return {"end": s.place(), "seconds": s.seconds() - begin}


@program(radius=Near(10.0, 0.5), seconds=Near(21.7, 1.08), height=Near(-6.0, 0.3))
def orbit(s: Session) -> Found:
    """Circle at a radius of 10 m and 3 m/s, that is 0.3 radians/s, once after half a radian.

    The speed lags by 0.9 s, so that one turn takes 2 pi / 0.3 sqrt(1 + (0.3 0.9)^2) = 21.7 s.
    """
    s.take_off()
    s.fly("moveToPosition", 10, 0, -6, 3)
    radii, times, turned, last = [], [], 0.0, 0.0
    while turned < 2 * math.pi + 0.5 and len(radii) < 200:
        x, y, _ = s.place()
        angle, radius = math.atan2(y, x), math.hypot(x, y)
        turned, last = turned + math.remainder(angle - last, 2 * math.pi), angle
        ahead, out = angle + 0.9 * 0.3, 10 - radius
        vx = -3 * math.sin(ahead) + out * math.cos(angle)
        vy = 3 * math.cos(ahead) + out * math.sin(angle)
        s.fly("moveByVelocityZ", vx, vy, -6, 0.2)
        radii.append(radius)
        times += [s.seconds()] if turned > 0.5 else []
    mean = sum(radii) / len(radii)
    return {"radius": mean, "seconds": times[-1] - times[0], "height": s.place()[2]}


@program(drift=Near(0.0, 0.1), results=[True, True], seconds=Near(10.0, 0.1))
def hover(s: Session) -> Found:
    """Stay within 0.1 m for 10 s."""
    s.take_off()
    s.fly("moveToPosition", 3, -2, -5, 2)
    results = [s.fly("hover"), s.fly("moveByVelocity", 0, 0, 0, 3)]
    before, begin = s.place(), s.seconds()
    s.fly("moveByVelocity", 0, 0, 0, 10)
    return {
        "drift": math.dist(s.place(), before),
        "results": results,
        "seconds": s.seconds() - begin,
    }


@program(corners=Near([[10, 0], [10, 10], [0, 10], [0, 0]], 0.5), seconds=Near(28.0, 0.5))
def square_by_velocity(s: Session) -> Found:
    """Fly 5 s at 2 m/s in each direction, with 2 s to stop."""
    s.take_off()
    corners, begin = [], s.seconds()
    for vx, vy in ((2, 0), (0, 2), (-2, 0), (0, -2)):
        s.fly("moveByVelocityZ", vx, vy, -3, 5)
        s.fly("moveByVelocityZ", 0, 0, -3, 2)
        corners.append(s.place()[:2])
    return {"corners": corners, "seconds": s.seconds() - begin}


@program(moved=Near(1.45, 0.07), aside=Near(0.0, 0.05), pitch=Near(-5.0, 0.3))
def angles(s: Session) -> Found:
    """Pitch 5 degrees down for 2 s at a constant height, after a lag of 0.16 s.

    That makes g tan(5 degrees) (2 - 0.16)^2 / 2 = 1.45 m.
    """
    s.take_off()
    s.fly("moveByVelocity", 0, 0, 0, 3)
    before, tilt = s.place(), math.radians(5)
    if hasattr(s.client, "moveByRollPitchYawZAsync"):  # pitch is positive with the nose down
        s.fly("moveByRollPitchYawZ", 0, tilt, 0, before[2], 2)
    else:
        name = "moveByAngle" if s.is_first else "moveByAngleZ"
        s.fly(name, -tilt, 0, before[2], 0, 2)
    x, y, _ = s.place()
    return {"moved": x - before[0], "aside": y - before[1], "pitch": s.angles()[0]}


@program(since="airsim-1.2", speed=Near(-1.89, 0.1))
def throttle(s: Session) -> Found:
    """Thrust of 0.7 for 1 s: 4 rotors of 4.179 N lift 1 kg by 11.70 - 9.81 = 1.89 m/s^2."""
    s.take_off()
    s.fly("moveByVelocity", 0, 0, 0, 3)
    if hasattr(s.client, "moveByRollPitchYawThrottleAsync"):
        s.fly("moveByRollPitchYawThrottle", 0, 0, 0, 0.7, 1)
    else:
        s.fly("moveByAngleThrottle", 0, 0, 0.7, 0, 1)
    return {"speed": s.client.getMultirotorState().kinematics_estimated.linear_velocity.z_val}


@program(since="airsim-1.2", moved=Near([8.0, -4.0], 0.5))
def manual(s: Session) -> Found:
    """Half a stick of 4 m/s forward and a quarter to the left, 4 s, and 2 s to stop: 8 and 4 m."""
    s.take_off()
    sticks = s.airsim.RCData(pitch=0.5, roll=-0.25, is_initialized=True, is_valid=True)
    s.client.moveByRC(sticks)
    s.fly("moveByManual", 4, 4, -3, 4)
    s.client.moveByRC(s.airsim.RCData(is_initialized=True, is_valid=True))
    s.fly("moveByManual", 4, 4, -3, 2)
    return {"moved": s.place()[:2]}


@program(until="AirSimClient", moved=Near([0.0, 0.0], 0.1), seconds=Near(3.0, 0.05))
def manual_without_sticks(s: Session) -> Found:
    """Hold the position in manual mode: version 1.1 can't set sticks."""
    s.take_off()
    before, begin = s.place(), s.seconds()
    s.fly("moveByManual", 4, 4, -3, 3)
    x, y, _ = s.place()
    return {"moved": [x - before[0], y - before[1]], "seconds": s.seconds() - begin}


@program(heading=Near(90.0, 5.0), turned=Near(-60.0, 15.0))
def turns(s: Session) -> Found:
    """Turn to 90 degrees, then at 30 degrees a second for 10 s: 300 degrees, or -60, within 5%."""
    s.take_off()
    s.fly("rotateToYaw", 90)
    first = s.angles()[1]
    s.fly("rotateByYawRate", 30, 10)
    return {"heading": first, "turned": math.remainder(s.angles()[1] - first, 360)}


@program(home=Near([0.0, 0.0, 0.0], 0.5), landed=0)
def home(s: Session) -> Found:
    """Return from 10 m and land."""
    s.take_off()
    s.fly("moveToPosition", 8, -6, -4, 3)
    s.fly("goHome")
    if s.is_first:
        return {"home": s.place(), "landed": s.client.getLandedState()}
    return {"home": s.place(), "landed": s.client.getMultirotorState().landed_state}


@program(since="airsim", moved=Near([12.0, 9.0, -8.0], 0.5))
def to_gps(s: Session) -> Found:
    """Fly to a place on Earth 12 m north (111,195 m a degree) and 9 m east of home, 8 m up."""
    s.take_off()
    start = s.client.getHomeGeoPoint()
    latitude = start.latitude + 12 / 111_195
    longitude = start.longitude + 9 / (111_195 * math.cos(math.radians(latitude)))
    up = s.client.getMultirotorState().gps_location.altitude + s.place()[2] + 8
    s.fly("moveToGPS", latitude, longitude, up, 3)
    return {"moved": s.place()}


@program(since="airsim", moved=Near([0.0, 10.0], 0.5))
def body_frame(s: Session) -> Found:
    """Fly ahead while facing east: 5 s at 2 m/s, and 2 s to stop."""
    s.take_off()
    s.fly("rotateToYaw", 90, 20, 1)
    s.fly("moveByVelocityBodyFrame", 2, 0, 0, 5)
    s.fly("moveByVelocityBodyFrame", 0, 0, 0, 2)
    return {"moved": s.place()[:2]}


_TWO = """{"Vehicles": {"A": {"VehicleType": "SimpleFlight", "X": 0, "Y": 0},
  "B": {"VehicleType": "SimpleFlight", "X": 0, "Y": 4}}}"""


@program(
    since="airsim-1.2",
    settings=_TWO,
    places=Near([[10.0, 0.0, -4.0], [10.0, -2.0, -4.0]], 0.5),
    apart=Near(2.0, 0.3),
)
def two_vehicles(s: Session) -> Found:
    """Fly both at once; each has its own origin, 4 m apart, and ends 2 m from the other one."""
    s.take_off("A")
    s.take_off("B")
    moves = [
        s.client.moveToPositionAsync(10, y, -4, 2, vehicle_name=name)
        for name, y in (("A", 0), ("B", -2))
    ]
    for one in moves:
        one.join()
    east = [s.client.simGetObjectPose(name).position.y_val for name in "AB"]
    return {"places": [s.place("A"), s.place("B")], "apart": east[1] - east[0]}


@program(since="airsim-1.2", settings=_TWO, name="A", collided=True)
def vehicles_collide(s: Session) -> Found:
    """Fly one vehicle into the other one."""
    for name in "AB":
        s.take_off(name)
        s.client.simGetCollisionInfo(name)
    s.client.moveByVelocityZAsync(0, -2, s.place("B")[2], 4, vehicle_name="B").join()
    found = s.client.simGetCollisionInfo("B")
    return {"name": found.object_name, "collided": found.has_collided}
