"""Notes on the flags of vectors: the mistake, its effect, and where it was reported."""

from __future__ import annotations

from twolink.conformance.vectors import Flag


def _import(description: str, effect: str, *first_seen: str) -> Flag:
    return Flag(kind="import", description=description, effect=effect, first_seen=first_seen)


def _dynamics(description: str, effect: str, *first_seen: str) -> Flag:
    return Flag(kind="dynamics", description=description, effect=effect, first_seen=first_seen)


FLAGS: dict[str, Flag] = {
    "Plain": _import("two uniform bars, nothing else", "whatever is wrong is wrong everywhere"),
    "Limits": _import("joints with limits", "limits are lost, or act where they should not"),
    "ContinuousNq2": _import(
        "a continuous joint has a cosine and a sine as its configuration in some engines",
        "angles are written to the wrong place",
    ),
    "Order": _import("joints stand before links", "joints are numbered by their place in the file"),
    "NegativeAxis": _import("an axis points backwards", "the sign of an angle is lost"),
    "AxisLength": _import("an axis is not a unit vector", "angles or torques are scaled"),
    "DefaultAxis": _import("no axis is given: it is x", "another axis is taken"),
    "ObliqueAxis": _import("link frames are turned", "rotations are composed in the wrong order"),
    "Base": _import("the first joint is off the root", "the origin is lost"),
    "ObliqueGravity": _import("gravity is not in the plane", "all of it, or none of it acts"),
    "Offset": _import("the arm is bent at joint angles zero", "angles are measured from elsewhere"),
    "CentreAcross": _import("mass centres are off the lines", "one component is lost"),
    "Aside": _import("the links move in parallel planes", "levers are measured in space"),
    "InertialRpy": _import(
        "the inertial frame is turned", "the rotation is ignored", "google-deepmind/mujoco 3559"
    ),
    "ProductOfInertia": _import("an inertia has products", "they are ignored, or change sign"),
    "ThinRod": _import("a rod without inertia about its own axis", "it is refused or repaired"),
    "LumpedOffset": _import(
        "a link is fixed at a distance",
        "it is dropped, or its inertia is not moved to the new mass centre",
        "newton-physics/newton 371",
        "petercorke/robotics-toolbox-python 636",
    ),
    "LumpedRotated": _import(
        "a link is fixed in a turned frame",
        "its inertia is not turned, or turned twice",
        "google-deepmind/mujoco 2982",
    ),
    "MasslessFrame": _import("a link has no inertial: it weighs nothing", "it weighs 1 kg"),
    "Scale": _import("an arm of a millimetre or a kilometre", "an absolute threshold acts"),
    "DampingDropped": _import("joints have damping", "it is dropped", "isaac-sim/IsaacSim 841"),
    "FrictionDropped": _import(
        "joints have dry friction",
        "it is dropped",
        "dartsim/dart 890",
        "newton-physics/newton 2302",
    ),
    "Decoration": _import(
        "shapes, transmissions and tags of others", "inertia is computed from the shapes"
    ),
    "Numbers": _import("numbers as few write them", "they are misread"),
    "Whitespace": _import("a vector goes over two lines", "it is misread as zero"),
    "FixedAxis": _import("a fixed joint has an axis of zero", "the file is refused"),
    "Mimic": _import("a fixed joint mimics another", "the file is refused"),
    "Namespace": _import("the robot is in an XML namespace", "the file is refused"),
    "Structure": Flag(
        kind="input", description="no chain of two joints", effect="another model is computed"
    ),
    "Format": Flag(kind="input", description="no URDF", effect="another model is computed"),
    "InvalidInertia": Flag(
        kind="input", description="an inertia that no body has", effect="it is used as it stands"
    ),
    "UpperTriangle": _dynamics(
        "M is symmetric", "only one triangle of it is filled", "stack-of-tasks/pinocchio 1298"
    ),
    "RelativeVsAbsolute": _dynamics(
        "θ2 is measured from link 1", "it is taken from the x-axis instead"
    ),
    "GravitySign": _dynamics("gravity points along +y", "it acts upwards"),
    "ArmatureIgnored": _dynamics("joints have armature", "it is missing in M"),
    "PointMass": _dynamics("links are point masses", "a division by an inertia of zero"),
    "MassRatio": _dynamics("links differ a thousandfold", "digits are lost in M⁻¹"),
    "NoGravity": _dynamics("gravity is zero", "a default of 9.81 acts"),
    "BigAngle": Flag(
        kind="numbers", description="angles of many turns", effect="they are reduced in binary32"
    ),
    "SpringDropped": _dynamics("joints have springs", "their torque is left out"),
    "StickSlip": _dynamics(
        "dry friction holds, lets go, and turns around",
        "friction creeps at rest, or acts late after a change of direction",
    ),
    "Restitution": _dynamics(
        "an impact with a coefficient of restitution",
        "the rebound has another speed, depends on the step, or is late",
    ),
    "ImpactLaw": _dynamics(
        "an impact with friction, by Stronge's law of restitution",
        "another law of impact is used, which gives another impulse",
    ),
}
