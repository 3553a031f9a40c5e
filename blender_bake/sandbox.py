# SPDX-License-Identifier: GPL-3.0-or-later
"""`python sandbox.py SCRATCH COMMAND…`: run COMMAND in this process, able to write only below SCRATCH.

The second protection against an untrusted .blend; the first is `sanitize`, inside Blender. Linux's Landlock refuses every write,
creation, renaming and removal elsewhere, and every TCP connection; reading stays allowed. Other systems and older kernels have only the
first. On all of them Blender's temporary folder and its user's folder are below SCRATCH, so that the user's start-up scripts and add-ons
do not run. This file needs neither Blender nor this package.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import struct
import sys
from pathlib import Path

SANDBOXED = "SRBF_CONFINED"  # in the environment of a sandboxed process
UNSANDBOXED = "SRBF_UNCONFINED"  # set by users whose Blender cannot start in the sandbox
LAUNCHERS = {"snap", "flatpak"}  # what these start needs rights that a sandboxed process has given up

# linux/landlock.h
CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
VERSION_OF_ABI = 1
RULE_PATH_BENEATH = 1
SET_NO_NEW_PRIVS = 38  # prctl
WRITE_FILE = 1 << 1
REMOVE_AND_MAKE = sum(1 << bit for bit in range(4, 13))  # folders, files, devices, sockets, pipes, links
REFER, TRUNCATE = 1 << 13, 1 << 14  # from the second and the third ABI on
BIND_AND_CONNECT = 0b11  # TCP, from the fourth on


def main() -> None:
    """Sandbox this process as far as the system can, then replace it by the command."""
    scratch, command = Path(sys.argv[1]).resolve(), sys.argv[2:]
    os.environ.update(environment(scratch))
    program = shutil.which(command[0])
    launched = program is not None and Path(program).resolve().name in LAUNCHERS
    if not (launched or os.environ.get(UNSANDBOXED)) and restrict_writes(scratch):
        os.environ[SANDBOXED] = "1"
    try:
        os.execvp(command[0], command)
    except OSError as error:
        sys.exit(f"cannot start Blender at {command[0]}: {error.strerror}")


def environment(scratch: Path) -> dict[str, str]:
    """Environment variables that put Blender's temporary and user folders below `scratch`, which is deleted when the bake ends."""
    places = dict.fromkeys(("TMPDIR", "TEMP", "TMP", "XDG_CACHE_HOME"), str(scratch))
    return {**places, "BLENDER_USER_RESOURCES": str(scratch / "user"), "PYTHONDONTWRITEBYTECODE": "1"}


def restrict_writes(folder: Path) -> bool:
    """Restrict this process and its children to writing below `folder`; False where the system has no such thing."""
    if sys.platform != "linux":
        return False
    system = ctypes.CDLL(None, use_errno=True)
    abi = system.syscall(CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(VERSION_OF_ABI))
    if abi < 1:
        return False
    writing = WRITE_FILE | REMOVE_AND_MAKE | (REFER if abi >= 2 else 0) | (TRUNCATE if abi >= 3 else 0)
    attributes = struct.pack("=QQ", writing, BIND_AND_CONNECT) if abi >= 4 else struct.pack("=Q", writing)
    rules = system.syscall(CREATE_RULESET, attributes, ctypes.c_size_t(len(attributes)), ctypes.c_uint32(0))
    if rules < 0:
        return False
    try:
        for path, allowed in ((folder, writing), (Path(os.devnull), writing & (WRITE_FILE | TRUNCATE))):
            place = os.open(path, os.O_PATH | os.O_CLOEXEC)
            try:
                beneath = struct.pack("=Qi", allowed, place)
                if system.syscall(ADD_RULE, rules, RULE_PATH_BENEATH, beneath, ctypes.c_uint32(0)):
                    return False
            finally:
                os.close(place)
        return not system.prctl(SET_NO_NEW_PRIVS, 1, 0, 0, 0) and not system.syscall(RESTRICT_SELF, rules, ctypes.c_uint32(0))
    finally:
        os.close(rules)


if __name__ == "__main__":
    main()
