"""Makes one file of a plugin: the author's modules, this package and the declaration that the host reads without running
anything. NumPy stays outside, in the Python that runs it. The same input gives the same bytes, so the same SHA-256."""

import importlib.util
import io
import os
import sys
import zipfile

from .plugin import Plugin, declaration

_OWN = os.path.dirname(os.path.abspath(__file__))
_RUN = "import {module}\nfrom resurvey_plugin import main\n\nmain({module}.{plugin})\n"


def own_python():
    """What runs a plugin that is built here: this very Python where it is that of an environment, else any python3."""
    is_environment = sys.prefix != sys.base_prefix or os.path.isdir(os.path.join(sys.prefix, "conda-meta"))
    return sys.executable if is_environment else "/usr/bin/env python3"


def build(source, output=None, python=None, others=()):
    """Writes `resurvey-plugin-NAME` (or into the directory `output`); gives its path and the names of the modules in it
    beside `source`: those that it imports from its own directory, and `others`, files or directories of packages."""
    directory, file = os.path.split(os.path.abspath(source))
    module = os.path.splitext(file)[0]
    if not module.isidentifier():
        raise ValueError(f"expected a file name that Python can import, found {file}")
    if module in getattr(sys, "stdlib_module_names", ()) or module in sys.modules:
        raise ValueError(f"{file} hides a module that is needed; give it another name")
    first_line = f"#!{_interpreter(python or own_python())}\n"
    plugin = _plugin_of(source, module)
    files = _imported(directory)
    for other in others:
        files.update(_below(directory, other))
    files.pop(file, None)
    path = os.path.join(output or os.path.dirname(source), f"resurvey-plugin-{plugin.NAME}")
    data = f"{first_line}{declaration(plugin)}\n".encode() + _archive({file: source, **files}, module, plugin)
    new = f"{path}.new"
    with open(new, "wb") as out:
        out.write(data)
    os.chmod(new, 0o755)
    os.replace(new, path)
    return path, sorted(files)


def _interpreter(python):
    """The words of a first line; the system cuts them at a space."""
    if os.path.exists(python):
        python = os.path.abspath(python)
        if len(python.split()) > 1:
            raise ValueError(f"expected an interpreter without spaces in its path, which no first line of a program can "
                             f"have; found {python}. Put the environment elsewhere")
    elif not os.path.exists(python.split()[0] if python.split() else ""):
        raise ValueError(f"expected the path of an interpreter, found {python!r}")
    return python


def _plugin_of(source, module):
    """The one plugin class that the file defines."""
    spec = importlib.util.spec_from_file_location(module, source)
    if spec is None:
        raise ValueError(f"expected a Python file, found {source}")
    loaded = importlib.util.module_from_spec(spec)
    sys.path.insert(0, os.path.dirname(os.path.abspath(source)))
    # Data classes and pickles look for the module that they stand in.
    sys.modules[module] = loaded
    try:
        spec.loader.exec_module(loaded)
    except SystemExit as end:
        raise ValueError(f"{source} ended while it was imported; let main(...) stand below if __name__ == \"__main__\":"
                         ) from end
    own = [value for value in vars(loaded).values()
           if isinstance(value, type) and issubclass(value, Plugin) and value.__module__ == module]
    # What others are made from is no plugin itself.
    plugins = [one for one in own if one.NAME and not any(one in other.__mro__[1:] for other in own)]
    if len(plugins) != 1:
        names = ", ".join(one.__name__ for one in plugins) or "none"
        raise ValueError(f"{source}: expected one class made from Plugin that has a NAME, found {names}")
    return plugins[0]


def _imported(directory):
    """Name in the archive → path, of all modules that were imported from the directory, but for this package."""
    files = {}
    for name, module in list(sys.modules.items()):
        path = getattr(module, "__file__", None)
        if not path or name.split(".")[0] == "resurvey_plugin":
            continue
        inside = os.path.relpath(os.path.abspath(path), directory)
        # By its name: the packages of an environment in the directory have other ones.
        if os.path.splitext(inside)[0] in (name.replace(".", os.sep), os.path.join(*name.split("."), "__init__")):
            files[inside] = path
    return {inside: path for inside, path in files.items() if inside.endswith(".py")}


def _below(directory, other):
    """Name in the archive → path, of one Python file or of all below a directory."""
    found = [os.path.join(place, file) for place, _, names in os.walk(other) for file in names if file.endswith(".py")]
    files = {os.path.relpath(os.path.abspath(path), directory): path for path in found or [other]}
    for inside, path in files.items():
        if inside.startswith(os.pardir) or not inside.endswith(".py") or not os.path.isfile(path):
            raise ValueError(f"expected a Python file below {directory}, or a directory of such, found {path}")
    return files


def _archive(files, module, plugin):
    files = dict(sorted(files.items()))
    for name in sorted(os.listdir(_OWN)):
        if name.endswith(".py") and name not in ("toy.py", "build.py", "__main__.py"):
            files[f"resurvey_plugin/{name}"] = os.path.join(_OWN, name)
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_STORED) as archive:
        _add(archive, "__main__.py", _RUN.format(module=module, plugin=plugin.__name__).encode())
        for name, path in files.items():
            with open(path, "rb") as file:
                _add(archive, name, file.read())
    return memory.getvalue()


def _add(archive, name, data):
    archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_STORED)
