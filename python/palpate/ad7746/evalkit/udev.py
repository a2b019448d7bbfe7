"""The udev rule that lets users open the board on Linux: found and installed. Needs no pyusb."""

import errno
import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from palpate.files import read_bytes, write_file

# For the user at the screen (uaccess), and for the users in a group (a machine without a screen).
UDEV_RULE = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="b481", MODE="0660", GROUP="plugdev", TAG+="uaccess"'
GROUP = "plugdev"
JOIN_GROUP = f"sudo groupadd --system --force {GROUP} && sudo usermod -aG {GROUP} $USER"  # Works again and again.
RULES = tuple(Path(root, "udev/rules.d") for root in ("/etc", "/run", "/usr/lib", "/lib"))
RULE_FILE = "70-palpate.rules"
_LARGEST = 1_000_000  # bytes of a file of rules
_BOARD = re.compile(r'(?=.*idVendor}=="0456").*idProduct}=="b481"', re.IGNORECASE)
_OF_BOARD = ("--subsystem-match=usb", "--attr-match=idVendor=0456", "--attr-match=idProduct=b481")
_UDEVADM = (("control", "--reload"), ("trigger", "--action=change", *_OF_BOARD))
_SYSTEM_PATH = "/sbin:/usr/sbin:/bin:/usr/bin"
_WAIT_S = 10.0


def rules_matter() -> bool:
    """Return whether this user needs a udev rule: on Linux, except root."""
    return sys.platform == "linux" and os.geteuid() != 0


def rule_files() -> list[Path]:
    """Return the files of udev rules that name the board."""
    return [
        file for folder in RULES for file in sorted(folder.glob("*.rules")) if _of_the_board(file)
    ]


def install() -> str:
    """Write the rule file; return what was done."""
    file = RULES[0] / RULE_FILE
    if not file.parent.parent.is_dir():
        raise FileNotFoundError(
            errno.ENOENT, "this system has no udev; of a container: type it on the host", str(file)
        )
    before = _rules(file) if file.exists() else []
    if before == [UDEV_RULE]:
        return f"{file} is there already"
    if before:
        text = f"has other rules, stays as it is; move it away, or put in: {UDEV_RULE}"
        raise FileExistsError(errno.EEXIST, text, str(file))
    file.parent.mkdir(exist_ok=True)
    comment = "# Access to the AD7746 evaluation kit; by `palpate doctor --install-udev`"
    write_file(file, f"{comment}\n{UDEV_RULE}\n".encode())
    file.chmod(0o644)
    return f"wrote {file}"


def reload() -> str:
    """Let udev apply its rules to a connected board again; return an error, or nothing."""
    udevadm = shutil.which("udevadm") or shutil.which("udevadm", path=_SYSTEM_PATH)
    if not udevadm:
        return "udevadm is not installed"
    for arguments in _UDEVADM:
        command = [udevadm, *arguments]
        try:
            subprocess.run(command, check=True, capture_output=True, text=True, timeout=_WAIT_S)
        except subprocess.CalledProcessError as error:
            return f"udevadm {arguments[0]}: {(error.stderr or str(error)).strip():.200}"
        except (OSError, subprocess.SubprocessError) as error:
            return f"udevadm {arguments[0]}: {str(error).strip():.200}"
    return ""


def _of_the_board(file: Path) -> list[str]:
    """Return the rules for the board in a file; nothing for a file that cannot be read."""
    with suppress(OSError):
        return [line for line in _rules(file) if _BOARD.search(line)]
    return []


def _rules(file: Path) -> list[str]:
    lines = map(str.strip, read_bytes(file, _LARGEST).decode(errors="replace").splitlines())
    return [line for line in lines if line and not line.startswith("#")]
