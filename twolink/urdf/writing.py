"""The parameters of a planar two-link chain as a URDF that every engine loads."""

from __future__ import annotations

from twolink.urdf.planar import LinkParameters

# Bars are drawn as rods of radius L/50. A rod's inertia about its own axis, m r²/2, is then this
# share of mL²/12. It never acts in the plane, but engines refuse a body without it.
_RADIUS = 1 / 50
_AXIAL = 12 * _RADIUS**2 / 2

_COLOURS = ("0.00 0.45 0.70 1", "0.90 0.62 0.00 1")

_TEMPLATE = """\
<?xml version="1.0"?>
<!-- A planar two-link chain: A, link1, B, link2, D; mass centres C1 and C2. SI units.
     The plane of motion is the world's x-z plane, z up. Joint axes are +y, so a positive angle
     turns x towards -z: downward. Both links lie along x at zero angle.
     iyy acts in the plane; ixx and izz never do, and keep the bodies physically possible. -->
<robot name="{name}">
  <link name="ground">
{massless}
  </link>
{links}
{joints}
{markers}
</robot>
"""

_LINK = """\
  <link name="link{number}">
    <inertial>
      <origin xyz="{centre}"/>
      <mass value="{mass!r}"/>
      <inertia ixx="{axial!r}" ixy="0" ixz="0" iyy="{inertia!r}" iyz="0" izz="{inertia!r}"/>
    </inertial>
{shapes}
  </link>"""

_SHAPE = """\
    <{use}>
      <origin xyz="{xyz}" rpy="{rpy}"/>
      <geometry><{geometry}/></geometry>{material}
    </{use}>"""

_JOINT = """\
  <joint name="joint{number}" type="continuous">
    <parent link="{parent}"/>
    <child link="link{number}"/>
    <origin xyz="{x!r} 0 0"/>
    <axis xyz="0 1 0"/>
  </joint>"""

# Said in full: without it some engines assume a mass of 1 kg.
_MASSLESS = """\
    <inertial>
      <mass value="0"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>
    </inertial>"""

_MARKER = """\
  <link name="{name}">
{massless}
  </link>
  <joint name="{name}_frame" type="fixed">
    <parent link="{parent}"/>
    <child link="{name}"/>
    <origin xyz="{xyz}"/>
  </joint>"""


def write_planar_urdf(
    links: tuple[LinkParameters, LinkParameters], *, name: str = "twolink"
) -> str:
    """Return the URDF text of two links, given in kg, m and kg m².

    Numbers are written so that reading them gives the same float64. Massless links named A, B,
    C1, C2 and D mark the points of the source.
    """
    first, second = links
    markers = {
        "A": ("ground", "0 0 0"),
        "B": ("link1", f"{first.length!r} 0 0"),
        "C1": ("link1", _centre(first)),
        "C2": ("link2", _centre(second)),
        "D": ("link2", f"{second.length!r} 0 0"),
    }
    return _TEMPLATE.format(
        name=name,
        massless=_MASSLESS,
        links="\n".join(_link(number, link) for number, link in enumerate(links, start=1)),
        joints="\n".join(
            [
                _JOINT.format(number=1, parent="ground", x=0.0),
                _JOINT.format(number=2, parent="link1", x=first.length),
            ]
        ),
        markers="\n".join(
            _MARKER.format(name=point, massless=_MASSLESS, parent=parent, xyz=xyz)
            for point, (parent, xyz) in markers.items()
        ),
    )


def _centre(link: LinkParameters) -> str:
    # Across, a quarter turn from x towards the source's y, is the world's -z.
    along, across = link.centre
    return f"{along!r} 0 {-across + 0.0!r}"


def _link(number: int, link: LinkParameters) -> str:
    return _LINK.format(
        number=number,
        centre=_centre(link),
        mass=link.mass,
        axial=_AXIAL * link.inertia,
        inertia=link.inertia,
        shapes="\n".join(
            _shape(use, *shape, number)
            for use in ("visual", "collision")
            for shape in _rod_with_round_ends(link.length)
        ),
    )


def _rod_with_round_ends(length: float) -> list[tuple[str, str, str]]:
    """Return position, direction and geometry of the shapes of a bar."""
    radius = length * _RADIUS or _RADIUS
    ball = f'sphere radius="{radius!r}"'
    rod = f'cylinder length="{length!r}" radius="{radius!r}"'
    ends = [("0 0 0", "0 0 0", ball)]
    if length > 0:
        ends.append((f"{length!r} 0 0", "0 0 0", ball))
        # A cylinder stands along z; a quarter turn about y lays it along x.
        ends.append((f"{length / 2!r} 0 0", "0 1.5707963267948966 0", rod))
    return ends


def _shape(use: str, xyz: str, rpy: str, geometry: str, number: int) -> str:
    material = ""
    if use == "visual":
        colour = _COLOURS[number - 1]
        material = f'\n      <material name="link{number}"><color rgba="{colour}"/></material>'
    return _SHAPE.format(use=use, xyz=xyz, rpy=rpy, geometry=geometry, material=material)
