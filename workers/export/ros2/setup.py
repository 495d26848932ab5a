"""Builds the ROS 2 package; the policy is installed with it."""

from pathlib import Path

from setuptools import setup

NAME = "mapless_navigator"


def files(directory: str) -> list[str]:
    """The files of a directory of this package."""
    return sorted(str(path) for path in Path(directory).iterdir())


setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", files("config")),
        (f"share/{NAME}/launch", files("launch")),
        (f"share/{NAME}/policy", files("policy")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    description="Drives a mobile robot to a goal with a policy that Mapless trained.",
    license="Apache-2.0",
    entry_points={"console_scripts": [f"navigator = {NAME}.node:main"]},
)
