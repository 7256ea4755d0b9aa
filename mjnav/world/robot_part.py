"""A robot's own MJCF as a part of a scene, checked: what the drive says must be what the model has.

Whatever of it touches anything touches the floor and things alike, and the lidar does not see it.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from collections.abc import Sequence

import mujoco
import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits
from mjnav.scene.robot import Base

KEY = "robot.model"
UNSEEN, FLOOR, THINGS = 1, 1, 2  # geom group, and collision bits as in models/robot.xml
RADIUS, TRACK = 0.02, 0.05  # by which a wheel's size and the sides' distance may differ from the figures, as shares
LEVEL = 0.99  # cosine of the least tilt at which an axis is no longer level
BODY = 0.05  # by which the body may reach beyond the robot's radius, as a share
_LIKE_THE_CHASSIS = ("type", "contype", "conaffinity", "condim", "friction", "priority", "solref", "group", "rgba")


def robot_part(base: Base, limits: RobotLimits) -> "mujoco.MjSpec":
    """The robot with its free joint named "free", and the discs of `limits` for its body.

    Raises InvalidValue for what cannot be driven by `base`, and for a body that reaches beyond its radius.
    """
    try:
        part = _of_discs(mujoco.MjSpec.from_string(base.mjcf), limits.discs)
        alone = part.copy().compile()
    except (ValueError, mujoco.FatalError) as error:
        raise _wrong(f"an MJCF that MuJoCo compiles, without files of meshes and textures ({error})") from None
    free = [joint for joint in part.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if len(free) != 1:
        raise _wrong(f"one body with a free joint, not {len(free)}")
    places = [_places(alone, base, names) for names in (base.left_wheels, base.right_wheels)]
    track = float(places[0] - places[1])
    if abs(track - base.track_width) > TRACK * base.track_width:
        raise _wrong(f"left and right wheels {base.track_width:g} m apart, as track_width says, not {track:.3g} m")
    reach, most = _reach(alone), max(abs(ahead) + radius for ahead, radius in limits.discs)
    if reach > (1.0 + BODY) * most:
        raise _wrong(f"a body that reaches {most:.3g} m, as radius and discs say, not {reach:.3g} m")
    free[0].name = "free"
    for geom in part.geoms:
        if geom.group == 0:
            geom.group = UNSEEN
        if geom.contype or geom.conaffinity not in (0, FLOOR, THINGS):
            geom.contype, geom.conaffinity = 0, FLOOR | THINGS
    return part


def _of_discs(part: "mujoco.MjSpec", discs: Sequence[tuple[float, float]]) -> "mujoco.MjSpec":
    """With one cylinder for each disc in place of the one that is named "chassis", whose mass they share.

    A body without it stays as it is.
    """
    whole = part.geom("chassis")
    if whole is None or whole.type != mujoco.mjtGeom.mjGEOM_CYLINDER:
        return part
    radius, half_height, _ = whole.size
    mass = whole.density * 2.0 * np.pi * radius**2 * half_height if np.isnan(whole.mass) else whole.mass
    for i, (ahead, radius) in enumerate(discs):
        disc = whole.parent.add_geom(name=f"chassis{i}") if i else whole
        for key in _LIKE_THE_CHASSIS:
            setattr(disc, key, getattr(whole, key))
        disc.pos, disc.size, disc.mass = [ahead, *whole.pos[1:]], [radius, *whole.size[1:]], mass / len(discs)
    return part


def _reach(model: "mujoco.MjModel") -> float:
    """How far at least what touches more than the floor reaches from the robot's axis [m], by its geoms' boxes."""
    data, reach = mujoco.MjData(model), 0.0
    mujoco.mj_kinematics(model, data)
    touching = model.geom_contype | (model.geom_conaffinity & ~FLOOR)
    for g in np.flatnonzero(touching * (model.geom_bodyid > 0)):  # body 0 is the world, as a floor of the file's own
        axes, (centre, half) = data.geom_xmat[g].reshape(3, 3), np.split(model.geom_aabb[g], 2)
        along = axes[:2].T @ (data.geom_xpos[g] + axes @ centre)[:2]  # (3,) of the box's axes, as far as they are level
        reach = max(reach, float(((np.abs(along) + half) * (np.hypot(*axes[:2]) > LEVEL)).max()))
    return reach


def _places(model: "mujoco.MjModel", base: Base, names: tuple[str, ...]) -> float:
    """How far to the left the wheels of one side are [m]."""
    data, places = mujoco.MjData(model), []
    mujoco.mj_kinematics(model, data)
    for name in names:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            hinges = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE).tolist()
            named = ", ".join(model.joint(j).name for j in hinges)
            raise _wrong(f"a wheel's hinge {name!r}; its hinges are {named or 'none'}")
        motors = [a for a in range(model.nu) if model.actuator_trnid[a, 0] == joint]
        law = [(int(model.actuator_biastype[a]), float(model.actuator_biasprm[a, 1])) for a in motors]
        if law != [(mujoco.mjtBias.mjBIAS_AFFINE, 0.0)]:  # of a position actuator the second is its stiffness
            raise _wrong(f"one velocity actuator on the hinge {name!r}")
        if data.xaxis[joint, 1] < LEVEL:
            raise _wrong(f"a wheel's hinge {name!r} along 0 1 0, to the left: else the robot drives another way")
        body = int(model.jnt_bodyid[joint])
        sizes = [float(model.geom_rbound[g]) for g in range(model.ngeom) if model.geom_bodyid[g] == body]
        sizes += [float(model.geom_size[g].max()) for g in range(model.ngeom) if model.geom_bodyid[g] == body]
        if not any(abs(size - base.wheel_radius) <= RADIUS * base.wheel_radius for size in sizes):
            found = ", ".join(f"{size:.3g}" for size in sorted(set(np.round(sizes, 6))))
            raise _wrong(f"a wheel {name!r} of radius {base.wheel_radius:g} m, as wheel_radius says, not {found} m")
        places.append(float(data.xpos[body][1]))
    return float(np.mean(places))


def _wrong(allowed: str) -> InvalidValue:
    return InvalidValue(KEY, None, allowed)
