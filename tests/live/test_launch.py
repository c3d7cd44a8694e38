#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Reads the launch file and the configuration of RViz: test_launch.py D2S1R_LIVE PROJECT

The launch file runs with stand-ins of ROS's packages launch and launch_ros, which note what it starts. d2s1r-live is then started with
the command line that launch makes of its node, and must run.
"""
import pathlib
import runpy
import signal
import subprocess
import sys
import tempfile
import types

sys.dont_write_bytecode = True


class Noted:
    """Keeps the arguments that it is made with."""
    def __init__(self, *args, **given):
        self.args, self.given = args, given


def stand_ins():
    """Returns modules by name, each of whose classes only notes its arguments."""
    names = {"launch": ["LaunchDescription"], "launch.actions": ["DeclareLaunchArgument"],
             "launch.substitutions": ["LaunchConfiguration"], "launch_ros": [], "launch_ros.actions": ["Node"],
             "launch_ros.parameter_descriptions": ["ParameterValue"]}
    modules = {}
    for name, classes in names.items():
        modules[name] = types.ModuleType(name)
        for one in classes:
            setattr(modules[name], one, type(one, (Noted,), {}))
    return modules


def text_of(value, arguments):
    """Returns what launch would write for a value into a file of parameters."""
    if isinstance(value, Noted):
        inner = value.args[0]
        return text_of(inner, arguments) if isinstance(inner, Noted) else arguments[inner]
    return value


def command_line(node, arguments, folder):
    """Returns the words that launch adds for a node."""
    import yaml
    words = ["--ros-args", "-r", f"__node:={node.given['name']}", "-r", f"__ns:=/{arguments['namespace']}"]
    for i, parameters in enumerate(node.given["parameters"]):
        file = folder / f"parameters{i}.yaml"
        values = {name: text_of(value, arguments) for name, value in parameters.items()}
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}))
        words += ["--params-file", str(file)]
    for source, target in node.given["remappings"]:
        words += ["-r", f"{source}:={target}"]
    return words


def check_launch(program, file):
    sys.modules.update(stand_ins())
    actions = runpy.run_path(str(file))["generate_launch_description"]().args[0]
    declared = {action.args[0]: action.given["default_value"] for action in actions if "default_value" in action.given}
    assert set(declared) == {"map", "namespace", "seed", "use_sim_time"}, declared
    nodes = {action.given["executable"]: action for action in actions if "executable" in action.given}
    assert set(nodes) == {"map_server", "amcl", "lifecycle_manager", "d2s1r-live"}, nodes
    with tempfile.TemporaryDirectory() as folder:
        words = command_line(nodes["d2s1r-live"], dict(declared, namespace="robot1"), pathlib.Path(folder))
        with subprocess.Popen([program, "--domain", "101", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as live:
            first = live.stdout.readline()
            live.send_signal(signal.SIGINT)
            rest = live.stdout.read()
    assert live.returncode == 0, (live.returncode, first + rest)
    assert first == "domain 101: waits for a map\n" and rest == "", first + rest


def check_rviz(file, topics):
    import yaml
    manager = yaml.safe_load(file.read_text())["Visualization Manager"]
    shown = {display["Topic"]["Value"] for display in manager["Displays"]}
    assert shown == {"map", "scan", "d2s1r/markers", "d2s1r/pose", "amcl_pose"}, shown
    for topic in shown:
        assert f'"{topic}"' in topics, f"{topic} is no topic of d2s1r-live"


def main():
    program, project = sys.argv[1], pathlib.Path(sys.argv[2])
    sources = "".join((project / "apps/d2s1r-live" / name).read_text() for name in ("flags.h", "topics.h"))
    check_launch(program, project / "share/d2s1r/launch/nav2.launch.py")
    check_rviz(project / "share/d2s1r/launch/d2s1r.rviz", sources)


if __name__ == "__main__":
    main()
