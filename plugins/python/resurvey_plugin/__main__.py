"""`python3 -m resurvey_plugin build FILE`."""

import argparse

from .build import build


def _run():
    parser = argparse.ArgumentParser(prog="python3 -m resurvey_plugin", description="Tools for plugin authors")
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("build", help="write resurvey-plugin-NAME, the one file that the host runs")
    command.add_argument("file", help="your module, with one class made from resurvey_plugin.Plugin")
    command.add_argument("--output", metavar="DIRECTORY", help="where to write it; default: beside the module")
    command.add_argument("--python", default="/usr/bin/env python3", metavar="PROGRAM",
                         help="what runs it, such as the python3 of a virtual environment; default: %(default)s")
    options = parser.parse_args()
    try:
        print(build(options.file, options.output, options.python))
    except (OSError, TypeError, ValueError) as error:
        parser.exit(1, f"error: {error}\n")


_run()
