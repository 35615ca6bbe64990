"""`python3 -m resurvey_plugin build FILE`."""

import argparse
import sys

from .build import build, own_python


def _run():
    parser = argparse.ArgumentParser(prog="python3 -m resurvey_plugin", description="Tools for plugin authors")
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("build", help="write resurvey-plugin-NAME, the one file that the host runs")
    command.add_argument("file", help="your module, with one class made from resurvey_plugin.Plugin; the modules beside it "
                                      "that it imports go along")
    command.add_argument("--with", dest="others", metavar="FILE", action="append", default=[],
                         help="another module of yours, or a directory of such, that is imported only later; may be repeated")
    command.add_argument("--output", metavar="DIRECTORY", help="where to write it; default: beside the module")
    command.add_argument("--python", default=own_python(), metavar="PROGRAM",
                         help="what runs it; default: the Python of the virtual environment that builds it, else "
                              "/usr/bin/env python3")
    options = parser.parse_args()
    try:
        path, others = build(options.file, options.output, options.python, options.others)
    except (OSError, TypeError, ValueError) as error:
        parser.exit(1, f"error: {error}\n")
    if others:
        print(f"with {', '.join(others)}", file=sys.stderr)
    print(path)


_run()
