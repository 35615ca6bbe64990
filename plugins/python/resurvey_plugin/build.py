"""Makes one file of a plugin: the author's module, this package and the declaration that the host reads without running
anything. NumPy stays outside, in the Python that runs it. The same input gives the same bytes, so the same SHA-256."""

import importlib.util
import io
import os
import sys
import zipfile

from .plugin import Plugin, declaration

_OWN = os.path.dirname(os.path.abspath(__file__))
_RUN = "import {module}\nfrom resurvey_plugin import main\n\nmain({module}.{plugin})\n"


def build(source, output=None, python="/usr/bin/env python3"):
    """Writes `resurvey-plugin-NAME` (or into the directory `output`); gives its path."""
    directory, file = os.path.split(source)
    module = os.path.splitext(file)[0]
    if not module.isidentifier():
        raise ValueError(f"expected a file name that Python can import, found {file}")
    plugin = _plugin_of(source, module)
    path = os.path.join(output or directory, f"resurvey-plugin-{plugin.NAME}")
    data = f"#!{python}\n{declaration(plugin)}\n".encode() + _archive(source, module, plugin)
    new = f"{path}.new"
    with open(new, "wb") as out:
        out.write(data)
    os.chmod(new, 0o755)
    os.replace(new, path)
    return path


def _plugin_of(source, module):
    """The one plugin class that the file defines."""
    spec = importlib.util.spec_from_file_location(module, source)
    if spec is None:
        raise ValueError(f"expected a Python file, found {source}")
    loaded = importlib.util.module_from_spec(spec)
    sys.path.insert(0, os.path.dirname(os.path.abspath(source)))
    spec.loader.exec_module(loaded)
    own = [value for value in vars(loaded).values()
           if isinstance(value, type) and issubclass(value, Plugin) and value.__module__ == module]
    if len(own) != 1:
        names = ", ".join(value.__name__ for value in own) or "none"
        raise ValueError(f"{source}: expected one class made from Plugin, found {names}")
    return own[0]


def _archive(source, module, plugin):
    files = {f"{module}.py": source}
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
