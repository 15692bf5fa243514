"""Where the suite's programs, bags and configurations are, in a devel or an install space."""
import os
import pathlib

import roslib.packages
import rospkg

_RECORDINGS = "FIELD_DATA_DIR"


def package(name):
    return pathlib.Path(rospkg.RosPack().get_path(name))


def program(package_name, name):
    """Path of a program that `rosrun package name` would start."""
    found = roslib.packages.find_node(package_name, name)
    if not found:
        raise RuntimeError(f"no program '{name}' in package {package_name}; build and source the workspace")
    return found[0]


def bag(name):
    return package("field_bags") / "bags" / f"{name}.bag"


def config(name, folder="bags", estimator="gp_localize"):
    return package("field_config") / folder / f"{name}.{estimator}.yaml"


def configured_bags(estimator="gp_localize"):
    """Names of the bundled bags that come with a configuration of the estimator."""
    files = (package("field_config") / "bags").glob(f"*.{estimator}.yaml")
    return sorted(path.name.split(".")[0] for path in files)


def source_root():
    """The repository; the sources are there when tests are built."""
    return pathlib.Path(__file__).resolve().parents[3]


def recordings():
    """Folder of published recordings, which are not part of the repository; None if it is not there."""
    named = os.environ.get(_RECORDINGS)
    folder = pathlib.Path(named) if named else source_root().parent / "shared" / "data"
    return folder if folder.is_dir() else None
