"""Robots with a gripper, as URDF and as MJCF: one finger follows the other, and drives and sensors name them."""

LIMITS = '<limit lower="-2.9" upper="2.9" velocity="2" effort="80"/>'
FINGER_LIMITS = '<limit lower="0" upper="0.04" velocity="0.2" effort="20"/>'


def link(name: str, mass: float) -> str:
    inertia = f'<inertia ixx="{mass / 50}" iyy="{mass / 60}" izz="{mass / 70}" ixy="0.001" ixz="0" iyz="0"/>'
    return (
        f'<link name="{name}"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="{mass}"/>{inertia}</inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str, inside: str) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0.1 0 0.2" rpy="0.1 0.2 0.3"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


GRIPPER_URDF = "".join(
    [
        '<robot name="toy"><!-- by hand -->',
        *(link(f"link{number}", 2.0) for number in range(4)),
        link("hand", 0.7),
        link("left", 0.2),
        link("right", 0.2),
        *(
            joint(f"joint{number}", "revolute", f"link{number - 1}", f"link{number}", f'<axis xyz="0 1 1"/>{LIMITS}')
            for number in range(1, 4)
        ),
        joint("to_hand", "fixed", "link3", "hand", ""),
        joint("finger1", "prismatic", "hand", "left", f'<axis xyz="0 1 0"/>{FINGER_LIMITS}'),
        joint(
            "finger2",
            "revolute",
            "hand",
            "right",
            f'<axis xyz="0 -1 0"/>{LIMITS}<mimic joint="finger1" multiplier="20"/>',
        ),
        '<transmission name="t"><joint name="finger1"/></transmission>',
        '<ros2_control name="c"><joint name="joint1"/><joint name="finger2"/></ros2_control></robot>',
    ]
)
GRIPPER_MJCF = """<mujoco><compiler angle="radian" eulerseq="zyx"/><worldbody><body name="link1" pos="0 0 .1">
<joint name="joint1" axis="0 1 0"/><geom size=".1" mass="1" pos=".1 .2 .3"/><frame pos="0 .1 1" euler=".2 .3 .4">
<body name="hand" euler="0.1 0 0.5"><joint name="joint2"/><geom type="box" size=".1 .2 .1" mass="1"/>
<body name="left" pos="0 .1 0" euler="1 2 3"><joint name="finger1" axis="0 1 1" pos=".1 .2 .3" ref=".1" range="0 1"/>
<geom type="box" size=".01 .02 .1" mass=".3"/></body>
<body name="right"><joint name="finger2" type="slide" axis="0 -1 0" range="0 .4"/><geom size=".01" mass=".2"/></body>
</body></frame></body></worldbody>
<tendon><fixed name="split"><joint joint="finger1" coef=".5"/><joint joint="finger2" coef=".5"/></fixed></tendon>
<equality><joint joint1="finger2" joint2="finger1" polycoef="0.02 0.5 0 0 0"/></equality>
<actuator><motor name="finger1" joint="joint1"/><general name="close" tendon="split"/></actuator>
<sensor><jointpos joint="finger1"/><actuatorfrc actuator="close"/><actuatorfrc actuator="finger1"/></sensor>
<keyframe><key name="home" qpos="0 0 .04 .04"/></keyframe></mujoco>"""
