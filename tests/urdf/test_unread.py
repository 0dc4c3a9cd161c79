"""Elements and attributes that are misspelt, given twice, or not read."""

import re

import pytest

from tests.urdf.robots import ELBOW_AXIS, ELBOW_ORIGIN, LOWER_CENTRE, PLAIN, edited
from twolink import UrdfError
from twolink.urdf import parse_planar_urdf
from twolink.urdf.repair import repair_urdf

LIMITED = ELBOW_AXIS + '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
DAMPED = ELBOW_AXIS + '<dynamics damping="1"/>'
IN_DRAKE = ('<robot name="plain"', '<robot name="plain" xmlns:drake="http://drake.mit.edu"')


def transmission(inner):
    return (
        "</robot>",
        f'<transmission name="t"><actuator name="m">{inner}</actuator></transmission></robot>',
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (LOWER_CENTRE, LOWER_CENTRE.replace("origin", "orign"),
         "<inertial> of link 'lower' must have <origin>; got <orign>"),
        (LOWER_CENTRE, LOWER_CENTRE.replace("origin", "Origin"),
         "<inertial> of link 'lower' must have <origin>; got <Origin>"),
        (LOWER_CENTRE, LOWER_CENTRE.replace("xyz", "XYZ"),
         "<origin> of link 'lower' must have xyz; got 'XYZ'"),
        (ELBOW_AXIS, DAMPED.replace("damping", "dampin"),
         "<dynamics> of joint 'elbow' must have damping; got 'dampin'"),
        (ELBOW_AXIS, DAMPED.replace("dynamics", "Dynamics"),
         "joint 'elbow' must have <dynamics>; got <Dynamics>"),
        (ELBOW_AXIS, LIMITED.replace("lower=", "lowr="),
         "<limit> of joint 'elbow' must have lower; got 'lowr'"),
        ('<link name="base"/>', '<link name="base"><inertia/></link>',
         "link 'base' must have <inertial>; got <inertia>"),
        # Programs differ in which of two elements they take.
        (ELBOW_AXIS, ELBOW_AXIS + '<axis xyz="0 -1 0"/>', "'elbow' must have one <axis>; got 2"),
        (ELBOW_ORIGIN, ELBOW_ORIGIN * 2, "joint 'elbow' must have one <origin>; got 2"),
        (ELBOW_AXIS, DAMPED + '<dynamics friction="1"/>', "joint 'elbow' must have one <dynamics>"),
        ('<mass value="1.5"/>', '<mass value="1.5"/><mass value="2"/>',
         "<inertial> of link 'lower' must have one <mass>; got 2"),
        ('<parent link="upper"/>', '<parent link="upper"/><parent link="base"/>',
         "joint 'elbow' must have one <parent>; got 2"),
        ('<link name="base"/>', f'<link name="base">{"<inertial/>" * 3}</link>',
         "link 'base' must have one <inertial>; got 3"),
    ],
)  # fmt: skip
def test_elements_that_are_given_twice_or_seem_to_be_misspelt_are_refused(old, new, words):
    text = edited((old, new))
    for read in (parse_planar_urdf, repair_urdf):
        with pytest.raises(UrdfError, match=re.escape(words)):
            read(text)


@pytest.mark.parametrize(
    ("edits", "named"),
    [
        ([(LOWER_CENTRE, '<origin xyz="0.25 0 0" rpy_deg="0 90 0"/>')],
         "rpy_deg of <origin> of link 'lower'"),
        ([("</robot>", '<loop_joint name="l"/></robot>')], "<loop_joint> of <robot>"),
        ([(ELBOW_AXIS, ELBOW_AXIS + '<dynamics damping="0" spring_stiffness="3"/>')],
         "spring_stiffness of <dynamics> of joint 'elbow'"),
        ([IN_DRAKE, transmission('<drake:rotor_inertia value="0.5"/>')],
         "<rotor_inertia> of <transmission>"),
        ([IN_DRAKE, ("</robot>", "<drake:linear_bushing_rpy/></robot>")],
         "<linear_bushing_rpy> of <robot>"),
        ([("</robot>", "<gazebo><springStiffness>2</springStiffness></gazebo></robot>")],
         "<springStiffness> of <gazebo>"),
        ([("</robot>", "<gazebo><gravity>0</gravity></gazebo></robot>")], "<gravity> of <gazebo>"),
        ([('<joint name="elbow"', '<joint armature="1" name="elbow"')],
         "armature of joint 'elbow'"),
    ],
)  # fmt: skip
def test_what_may_change_the_motion_and_is_not_read_is_named(edits, named):
    found = parse_planar_urdf(edited(*edits))
    (note,) = [note for note in found.notes if "not read" in note]
    assert note == f"The file has properties that are not read, and do not act: {named}."
    assert found.links == parse_planar_urdf(PLAIN).links


@pytest.mark.parametrize(
    "edit",
    [
        ("</robot>", "<gazebo><gravity>true</gravity><springStiffness>0</springStiffness>"
         "</gazebo></robot>"),
        transmission('<rotor_inertia value="0"/><mechanicalReduction>50</mechanicalReduction>'),
        (ELBOW_AXIS, ELBOW_AXIS + '<safety_controller k_velocity="1"/>'),
        ('<link name="base"/>', '<link name="base"><!-- two --><visual/><visual/></link>'),
        ("</robot>", '<material name="red"/></robot>'),
    ],
)  # fmt: skip
def test_elements_that_do_not_change_the_motion_are_not_named(edit):
    assert parse_planar_urdf(edited(edit)).notes == parse_planar_urdf(PLAIN).notes


def test_very_many_properties_are_counted():
    many = "".join(f"<a{number}/>" for number in range(30))
    found = parse_planar_urdf(edited(("</robot>", f"{many}</robot>")))
    (note,) = [note for note in found.notes if "not read" in note]
    assert note.endswith("<a7> of <robot>, 22 more.")
